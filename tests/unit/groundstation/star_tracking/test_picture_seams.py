"""Straight steps that no lens made are found; edges, noise, shades and coarse JPEGs are none."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles.seams import sum_steps

from groundstation.core.library import default_core
from groundstation.star_tracking.detection import detect
from groundstation.star_tracking.fixes import NoFix, PictureFix, Refusal
from groundstation.star_tracking.picture_seams import OWN_AFTER, PictureSeams
from groundstation.star_tracking.tracker import StarTracker

ROWS, COLUMNS = 480, 640
POSE = (2.4, 1.9, 0.7)


@pytest.fixture
def picture(painter):
    """A good one whose background is brighter to the left and to the bottom."""
    v, u = np.indices((ROWS, COLUMNS))
    light = 18.0 * (COLUMNS - u) / COLUMNS + 9.0 * v / ROWS
    painted = painter.paint(np.random.default_rng(3), POSE)
    return (painted + light).clip(0, 255).astype(np.uint8)


@pytest.mark.core
@settings(max_examples=40, deadline=None)
@given(
    st.integers(32, 70),
    st.integers(32, 70),
    st.integers(0, 9),
    st.integers(1, 255),
    st.integers(0, 2**32 - 1),
)
def test_the_core_sums_what_numpy_sums(rows, columns, more, most_dn, seed):
    wide = np.random.default_rng(seed).integers(0, 256, (rows, columns + more), np.uint8)
    view = wide[:, :columns]
    core = default_core()
    down, across = np.empty((rows - 1, 2), np.int32), np.empty((2, columns - 1), np.int32)
    pointers = [core.ffi.cast("int32_t *", out.ctypes.data) for out in (down, across)]
    pixels = core.ffi.cast("uint8_t *", view.ctypes.data)
    core.lib.gs_seams(pixels, view.strides[0], rows, columns, most_dn, *pointers)
    expected_down, expected_across = sum_steps(view, most_dn)
    assert (down == expected_down).all()
    assert (across == expected_across).all()


def bytes_lost(picture, lost):
    flat = picture.ravel()
    at = 25 * COLUMNS + 100
    return np.concatenate((flat[:at], flat[at + lost :], flat[:lost])).reshape(picture.shape)


@pytest.mark.parametrize("lost", [2, 7, 2562, 639, 3 * COLUMNS + 5])
def test_what_lost_bytes_above_the_first_star_has_a_seam_where_its_rows_wrap(picture, lost):
    words = PictureSeams().find(bytes_lost(picture, lost))
    assert f"from column {COLUMNS - lost % COLUMNS - 1} " in words


@pytest.mark.parametrize("row", [3, 200, 430])
@pytest.mark.parametrize("by_dn", [-5, 6])
def test_what_is_darker_or_brighter_from_a_row_on_has_a_seam_there(picture, row, by_dn):
    stepped = picture.astype(int)
    stepped[row:, :] += by_dn
    stepped[row, :300] -= by_dn  # a JPEG's wrong block lies somewhere in its row of blocks
    words = PictureSeams().find(stepped.clip(0, 255).astype(np.uint8))
    assert f"from row {row - 1} " in words or f"from row {row} " in words


def test_a_picture_with_a_seam_gives_no_fix_and_says_where(catalogue, camera, picture):
    tracker = StarTracker(catalogue, camera)
    assert isinstance(tracker.solve(detect(picture)), PictureFix)
    answer = tracker.solve(detect(bytes_lost(picture, 7)))
    assert isinstance(answer, NoFix)
    assert answer.reason is Refusal.TORN
    assert "from column 632 to the next" in answer.detail


@pytest.mark.parametrize("quality", [40, 60, 90])
def test_coarse_jpegs_have_none(picture, quality):
    _, file = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])
    assert PictureSeams().find(cv2.imdecode(file, cv2.IMREAD_GRAYSCALE)) == ""


@pytest.mark.parametrize("noise_dn", [0.0, 3.0, 12.0])
def test_straight_edges_through_a_lens_and_noise_have_none(noise_dn):
    rng = np.random.default_rng(1)
    beam = np.full((ROWS, COLUMNS), 20.0)
    beam[180:240] = beam[:, 400:440] = 70.0  # in line with the rows and columns, to the pixel
    seen = cv2.GaussianBlur(beam, (0, 0), 0.8) + rng.normal(0.0, 1.0, beam.shape) * noise_dn
    assert PictureSeams().find(seen.clip(0, 255).astype(np.uint8)) == ""


def test_a_hot_row_is_none_and_neither_are_columns_that_alternate(picture):
    lined = picture.copy()
    lined[100], lined[:, 333] = 90, 0
    lined[:, ::2] = lined[:, ::2] // 10 * 10
    assert PictureSeams().find(lined) == ""


def test_what_is_always_there_is_the_cameras_own(picture):
    seams = PictureSeams()
    halves = picture.copy()
    halves[:, COLUMNS // 2 :] += 9
    words = [seams.find(halves) for _ in range(OWN_AFTER + 5)]
    assert all(words[:OWN_AFTER])
    assert not any(words[OWN_AFTER:])
    assert seams.find(bytes_lost(halves, 7))  # another one is still seen
    assert not seams.find(picture)
    assert seams.find(halves)  # it was not always there


def test_pictures_of_another_size_begin_anew(picture):
    seams = PictureSeams()
    assert not seams.find(picture)
    small = np.ascontiguousarray(picture[:240, :320])
    assert not seams.find(small)
    assert seams.find(np.vstack((small[:100], small[100:] + 9)))
