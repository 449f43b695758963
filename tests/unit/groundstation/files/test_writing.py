import os
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from groundstation.files.errors import FileError
from groundstation.files.png import png_of, write_png
from groundstation.files.writing import check_folder, check_targets, whole_folder, write_files


def test_several_files_are_written_together(tmp_path):
    write_files({tmp_path / "a": b"\x00", tmp_path / "b": "text", tmp_path / "c": (f"{i}\n" for i in "12")})
    assert [(tmp_path / name).read_bytes() for name in "abc"] == [b"\x00", b"text", b"1\n2\n"]


def test_none_is_written_if_one_cannot_be(tmp_path):
    (tmp_path / "a").write_text("before")
    (tmp_path / "folder").mkdir()
    for bad in (tmp_path / "folder", tmp_path / "nowhere" / "b"):
        with pytest.raises(FileError, match=r": cannot be written \(.+\)\.$"):
            write_files({tmp_path / "a": "after", bad: "x"})
        assert (tmp_path / "a").read_text() == "before"
        assert sorted(p.name for p in tmp_path.iterdir()) == ["a", "folder"]


def test_a_failure_while_the_lines_are_made_leaves_nothing(tmp_path):
    def lines():
        yield "first\n"
        raise RuntimeError("no second")

    with pytest.raises(RuntimeError):
        write_files({tmp_path / "a": lines()})
    assert not list(tmp_path.iterdir())


def test_targets_are_refused_before_any_work(tmp_path):
    check_targets(tmp_path / "a", None)
    with pytest.raises(FileError, match="there is no folder"):
        check_targets(tmp_path / "nowhere" / "a")
    with pytest.raises(FileError, match="it is a folder"):
        check_targets(tmp_path)
    for bad in (tmp_path / ("x" * 300), tmp_path / "file" / "x"):
        (tmp_path / "file").touch()
        with pytest.raises(FileError, match="cannot be written"):
            check_targets(bad)
        with pytest.raises(FileError, match="no such folder can be made"):
            check_folder(bad)
    with pytest.raises(FileError, match="no such folder can be made in /proc"):  # ours to write in, it says
        check_folder(Path("/proc/x"))
    check_folder(tmp_path / "new" / "report")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_target_that_is_read_or_written_twice_is_refused(tmp_path):
    there = tmp_path / "there"
    there.write_text("1")
    (tmp_path / "linked").symlink_to(there)
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "frame").touch()
    check_targets(tmp_path / "a", tmp_path / "b", sources=[there, None, tmp_path / "gone"])
    check_targets(tmp_path / "folder" / "answer", sources=[tmp_path / "folder"])
    for target, source in (
        (there, there),
        (tmp_path / "folder" / ".." / "there", there),
        (tmp_path / "linked", there),
        (tmp_path / "gone", tmp_path / "gone"),
        (tmp_path / "folder" / "frame", tmp_path / "folder"),
    ):
        with pytest.raises(FileError, match="is a file that is read"):
            check_targets(tmp_path / "a", target, sources=[None, source])
    for one, other in ((there, there), (there, tmp_path / "linked"), (tmp_path / "a", tmp_path / "a")):
        with pytest.raises(FileError, match="is to be written twice"):
            check_targets(one, other)


def test_a_pipe_or_a_device_is_never_replaced_by_a_file(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(FileError, match="it is no file"):
        check_targets(tmp_path / "pipe")
    with pytest.raises(FileError, match="it is no file"):
        write_files({tmp_path / "pipe": "x"})
    assert (tmp_path / "pipe").is_fifo()
    assert [path.name for path in tmp_path.iterdir()] == ["pipe"]


@pytest.mark.parametrize("length", [1, 200, 255])
def test_a_name_as_long_as_the_disk_takes_is_written_and_one_that_no_locale_could_decode(tmp_path, length):
    write_files({tmp_path / ("x" * length): "S\udcc3\udcbcd ± 1\n"})
    assert (tmp_path / ("x" * length)).read_text(encoding="utf-8") == "Süd ± 1\n"


def test_a_folder_comes_whole_or_not_at_all(tmp_path):
    with pytest.raises(FileError), whole_folder(tmp_path / "out") as folder:
        (folder / "one" / "two").write_text("1")
    assert not list(tmp_path.iterdir())
    with whole_folder(tmp_path / "out"):
        assert [path.name.startswith(".part.") for path in tmp_path.iterdir()] == [True]
    assert not list(tmp_path.iterdir())  # nothing was written: no folder
    with whole_folder(tmp_path / "out") as folder:
        (folder / "one").write_text("1")
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["one"]


@pytest.mark.parametrize("what", [np.zeros((4, 5), np.uint8), Figure(figsize=(1, 1))])
def test_pictures_and_figures_become_png(tmp_path, what):
    write_png(tmp_path / "a.png", what)
    data = (tmp_path / "a.png").read_bytes()
    assert data == png_of(what)
    assert data.startswith(b"\x89PNG")


@pytest.mark.parametrize("is_ours", [True, False])
def test_a_full_disk_is_told_by_the_folder_that_was_asked_for(is_ours, tmp_path):
    there = tmp_path / "there"
    there.mkdir()
    (there / "a").write_text("before")

    def write(folder):
        (folder / "a").write_text("after")
        (folder / "b").symlink_to("/dev/full")
        if is_ours:
            raise FileError(f"{folder / 'b'}: cannot be written (No space left on device).")
        with (folder / "b").open("w") as file:
            file.write("text")

    said = f"^{there}.*: cannot be written .No space left on device"
    with pytest.raises(FileError, match=said), whole_folder(there) as folder:
        write(folder)
    assert [path.name for path in tmp_path.iterdir()] == ["there"]
    assert (there / "a").read_text() == "before"


def test_a_file_that_is_read_keeps_its_name_in_what_is_said(tmp_path):
    with pytest.raises(FileNotFoundError, match="nowhere"), whole_folder(tmp_path / "new"):
        (tmp_path / "nowhere").read_text()
