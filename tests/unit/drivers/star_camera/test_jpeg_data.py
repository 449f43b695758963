"""A JPEG with data left behind its last block has lost its place; whole ones of every kind have none left."""

import io

import cv2
import numpy as np
import pytest
from PIL import Image

from drivers.star_camera.jpeg_data import is_used_up
from drivers.star_camera.picture import decode_picture
from drivers.star_camera.refusals import PictureRefused

END = b"\xff\xd9"


def picture(seed, noise=3.0):
    rng = np.random.default_rng(seed)
    v, u = np.indices((120, 160))
    image = 12.0 + noise * rng.standard_normal((120, 160)) + 0.05 * u
    for star_u, star_v in rng.uniform((5, 5), (155, 115), (12, 2)):
        image += 180.0 * np.exp(-0.3 * ((u - star_u) ** 2 + (v - star_v) ** 2))
    return image.clip(0, 255).astype(np.uint8)


@pytest.mark.parametrize("restarts", [0, 1, 7])
@pytest.mark.parametrize("is_colour", [False, True])
@pytest.mark.parametrize("quality", [10, 50, 75, 90, 100])
def test_whole_pictures_are_used_up(quality, is_colour, restarts):
    for seed in range(20):
        image = picture(seed, noise=0.0 if seed % 2 else 3.0)
        image = np.dstack((image, image // 2, image)) if is_colour else image
        words = [cv2.IMWRITE_JPEG_QUALITY, quality, cv2.IMWRITE_JPEG_RST_INTERVAL, restarts]
        file = cv2.imencode(".jpg", image, words)[1].tobytes()
        assert is_used_up(file)
        decode_picture({}, file)
        for filling in (b"\0", b"\0\0\0", b"\xff"):  # what some cameras put before the end marker
            assert is_used_up(file[:-2] + filling + END)


@pytest.mark.parametrize("words", [{"progressive": True}, {"optimize": True}])
def test_other_forms_of_whole_pictures_are_no_worse(words):
    for seed in range(10):
        file = io.BytesIO()
        Image.fromarray(picture(seed)).save(file, "JPEG", quality=85, **words)
        assert is_used_up(file.getvalue())
        assert np.abs(decode_picture({}, file.getvalue()).astype(int) - picture(seed)).mean() < 4.0


def test_data_that_are_left_mean_damage_though_the_decoder_is_content():
    file = cv2.imencode(".jpg", picture(1), [cv2.IMWRITE_JPEG_QUALITY, 80])[1].tobytes()
    more = file[:-2] + b"\x3a\x51\x07" + END
    assert not is_used_up(more)
    with pytest.raises(PictureRefused, match="go on behind its last block"):
        decode_picture({}, more)


def test_what_is_no_jpeg_at_all_is_left_to_the_decoder():
    for file in (b"", END, b"\xff\xd8" + END, b"\xff\xd8\xff\xff\xff\xff", b"\xff\xd8\xff\xc0\0"):
        assert is_used_up(file)
