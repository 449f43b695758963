"""Pictures delivered twice are named; those of a vehicle that rests under still lights are not."""

import cv2
import numpy as np
import pytest

from groundstation.star_tracking.picture_repeats import REMEMBERED, PictureRepeats

MS = 1_000_000
ROWS, COLUMNS = 480, 640


def sky(rng, *, is_clipped=False, black_dn=10.0, noise_dn=2.0, lights=12):
    """A still sky with the noise of one exposure; the clipped camera shows none where there is no light."""
    places = np.random.default_rng(5)
    light = np.zeros((ROWS, COLUMNS))
    v, u = np.mgrid[-4:5, -4:5]
    for row, column in zip(
        places.integers(10, ROWS - 10, lights), places.integers(10, COLUMNS - 10, lights), strict=True
    ):
        light[row - 4 : row + 5, column - 4 : column + 5] += 180.0 * np.exp(-(u**2 + v**2) / 4.0)
    noise = rng.normal(0.0, noise_dn, light.shape) * np.sqrt(1.0 + light / 10.0)
    if is_clipped:
        return np.clip(light + noise - 40.0, 0, 255).astype(np.uint8)
    return np.clip(light + noise + black_dn, 0, 255).astype(np.uint8)


def pictures(count, **options):
    rng = np.random.default_rng(1)
    return [sky(rng, **options) for _ in range(count)]


def complaints(shown, repeats=None):
    repeats = repeats or PictureRepeats()
    return [repeats.complaint_about(picture, 100 * MS * number) for number, picture in enumerate(shown)]


@pytest.mark.parametrize("is_clipped", [False, True])
def test_pictures_of_a_still_sky_are_all_different(is_clipped):
    assert not any(complaints(pictures(80, is_clipped=is_clipped)))


@pytest.mark.parametrize("is_clipped", [False, True])
def test_a_frozen_camera_is_named_with_the_age_of_its_picture(is_clipped):
    a, b = pictures(2, is_clipped=is_clipped)
    found = complaints([a, b, b, b])
    assert found[:2] == ["", ""]
    assert found[2] == "frozen picture: it repeats the one of 0.10 s before byte for byte"
    assert "0.20 s" in found[3]


def test_a_loop_is_named_up_to_the_number_of_pictures_remembered():
    loop = pictures(REMEMBERED)
    found = complaints([*loop, *loop])
    assert not any(found[:REMEMBERED])
    assert all(text.startswith("frozen picture: it repeats the one of 6.40 s") for text in found[REMEMBERED:])
    longer = pictures(REMEMBERED + 1)
    assert not any(complaints([*longer, longer[0]]))


@pytest.mark.parametrize("is_clipped", [False, True])
@pytest.mark.parametrize("back", [1, 2])
def test_a_picture_torn_between_two_is_named(back, is_clipped):
    a, b, c, after = pictures(4, is_clipped=is_clipped)
    before = (c, b)[back - 1]
    torn = np.vstack((after[:200], before[200:]))
    found = complaints([a, b, c, torn, after])
    assert found[:3] == [""] * 3
    assert found[3].startswith("torn picture: of rows 210 to 479 some are those of a picture before")
    assert found[4].startswith("torn picture")  # its upper part was delivered with the torn one


def test_rows_without_light_and_full_pixels_may_be_equal():
    dark = np.zeros((ROWS, COLUMNS), np.uint8)
    dark[40:44, 40:48] = 255
    assert complaints([dark, dark, dark]) == ["", "", ""]
    first, second = pictures(2, is_clipped=True)
    first[300:], second[300:] = 0, 0
    first[400:404, 40:48] = second[400:404, 40:48] = 255
    assert complaints([first, second]) == ["", ""]


@pytest.mark.parametrize("count", [1, 2, 5, 40])
def test_rows_that_come_twice_are_named(count):
    (picture,) = pictures(1)
    twice = np.vstack((picture[: 100 + count], picture[100:]))[:ROWS]
    (found,) = complaints([twice])
    assert found.startswith("torn picture: row ")
    assert found.endswith(" again")
    over = picture.copy()
    over[300 : 300 + count] = picture[20 : 20 + count]
    (found,) = complaints([over])
    assert found.startswith("torn picture: row ")


@pytest.mark.parametrize("quality", [20, 50, 80, 95])
@pytest.mark.parametrize("is_clipped", [False, True])
def test_rows_that_a_jpeg_or_a_clipping_camera_makes_equal_are_no_repetition(quality, is_clipped):
    for picture in pictures(6, is_clipped=is_clipped):
        data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
        assert complaints([picture]) == [""]
        assert complaints([np.asarray(cv2.imdecode(data, cv2.IMREAD_GRAYSCALE))]) == [""]


def test_a_camera_that_thaws_is_believed_again_at_once():
    a, b, c = pictures(3)
    assert [bool(text) for text in complaints([a, b, b, c])] == [False, False, True, False]


def test_colour_pictures_are_compared_likewise():
    rng = np.random.default_rng(2)
    a, b = (rng.integers(0, 255, (240, 320, 3), np.uint8) for _ in range(2))
    assert complaints([a, b])[1] == ""
    assert complaints([a, a])[1].startswith("frozen")
    assert complaints([a, np.vstack((b[:100], a[100:]))])[1].startswith("torn")


def test_a_picture_of_few_rows_is_no_mistake():
    picture = np.full((3, 40), 7, np.uint8)
    picture[1, :20] = 100
    assert [bool(text) for text in complaints([picture, picture])] == [False, True]


def test_rows_that_a_mosaic_copies_to_the_border_are_no_repetition():
    (picture,) = pictures(1)
    picture[0], picture[-1] = picture[1], picture[-2]
    assert complaints([picture]) == [""]
    picture[2] = picture[1]
    assert complaints([picture])[0].startswith("torn picture")


def test_a_flat_colour_is_no_noise():
    """Neighbouring bytes of it differ, neighbouring pixels do not."""
    picture = np.tile(np.array([10, 90, 200], np.uint8), (240, 320, 1))
    picture[100:140, 100:140] = np.random.default_rng(4).integers(0, 255, (40, 40, 3), np.uint8)
    assert complaints([picture]) == [""]
