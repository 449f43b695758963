"""A film that the disk did not take is no result, whatever its writer says."""

import resource

import cv2
import numpy as np
import pytest

from groundstation.files.errors import FileError
from groundstation.files.film import check_film_name, new_film

SIZE = (320, 240)


@pytest.fixture
def nearly_full():
    """No file may grow beyond 60 kB, as on a disk that is nearly full."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, limits[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, limits)


def write(path, count):
    noise = np.random.default_rng(1)
    with new_film(path, 25.0, SIZE) as film:
        for _ in range(count):
            film.write(noise.integers(0, 255, (SIZE[1], SIZE[0], 3), dtype=np.uint8))
    return film


@pytest.mark.parametrize("ending", [".avi", ".mp4"])
@pytest.mark.parametrize("count", [1, 12])
def test_every_picture_is_in_the_film(ending, count, tmp_path):
    path = tmp_path / f"film{ending}"
    film = write(path, count)
    found = cv2.VideoCapture(str(path))
    assert sum(iter(found.grab, False)) == count == film.count
    assert (found.get(cv2.CAP_PROP_FRAME_WIDTH), found.get(cv2.CAP_PROP_FRAME_HEIGHT)) == SIZE
    assert [each.name for each in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("ending", [".avi", ".mp4"])
def test_one_that_is_not_taken_whole_leaves_what_was_there(ending, tmp_path, nearly_full, capfd):
    path = tmp_path / f"film{ending}"
    path.write_bytes(b"the film of yesterday")
    with pytest.raises(FileError, match=f"^{path}: cannot be written"):
        write(path, 15)
    assert path.read_bytes() == b"the film of yesterday"
    assert [each.name for each in tmp_path.iterdir()] == [path.name]
    assert capfd.readouterr().err == ""  # OpenCV's own lines are for nobody


def test_what_fails_while_it_is_made_leaves_nothing(tmp_path):
    with pytest.raises(KeyboardInterrupt), new_film(tmp_path / "film.avi", 25.0, SIZE):
        raise KeyboardInterrupt
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_is_not_there_and_an_ending_that_no_film_has_are_named(tmp_path):
    with pytest.raises(FileError, match=r"gone/film\.avi: cannot be written \(No such file"):
        write(tmp_path / "gone" / "film.avi", 1)
    with pytest.raises(FileError, match=r"of --annotated ends in \.mp4 or \.avi, found .film\.gif"):
        check_film_name(tmp_path / "film.gif", "the film of --annotated")
