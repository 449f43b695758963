"""Detection and its oracle in NumPy: the same spots in every picture."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles.detection import OracleDetector

from groundstation.core.build import compile_core
from groundstation.core.library import load_core
from groundstation.star_tracking import detection
from groundstation.star_tracking.detection import Detector, DetectorSettings, PictureError, detect

pytestmark = pytest.mark.core

ROUNDING_PX = 1e-7  # sums of another order, the exponential's last bits; both fits end after two steps


@pytest.fixture(scope="module")
def both():
    """Both detectors, the same ones for all pictures: what one leaves behind must not show in the next."""
    return Detector(), OracleDetector()


def assert_equal_spots(both, image):
    compiled, pure = (detector.find(image) for detector in both)
    for name in ("background_dn", "noise_dn", "hot_pixels", "cut_by_edge", "is_flooded"):
        assert getattr(compiled, name) == getattr(pure, name), name
    assert len(compiled) == len(pure)
    if len(pure) == 0:
        return pure
    # Equally bright spots may change places.
    far = np.hypot(compiled.u_px[:, None] - pure.u_px, compiled.v_px[:, None] - pure.v_px)
    twin = far.argmin(axis=0)
    assert len(set(twin)) == len(pure)
    assert far.min(axis=0).max() < ROUNDING_PX
    for name in ("flux_dn", "covariance_px2", "elongation", "streak_px"):
        one, two = getattr(compiled, name)[twin], getattr(pure, name)
        if name == "streak_px":  # whose sign is unknown
            two = two * np.where((one * two).sum(axis=1, keepdims=True) < 0.0, -1.0, 1.0)
        np.testing.assert_allclose(one, two, rtol=1e-6, atol=1e-9 * np.abs(two).max(), err_msg=name)
    assert (np.diff(compiled.flux_dn) <= 0.0).all()
    return pure


def sky(rng, shape, stars, background, streak=(0.0, 0.0), flux=(100.0, 3000.0), width=1.2, slope=0.0):
    """Picture of blurred lines (points where the streak is nil) on a sloping background."""
    rows, columns = np.indices(shape, dtype=np.float32)
    light = np.full(shape, background, np.float32) + slope * columns / shape[1]
    for u, v, total in zip(
        rng.uniform(0, shape[1], stars),
        rng.uniform(0, shape[0], stars),
        rng.uniform(*flux, stars),
        strict=True,
    ):
        steps = max(1, int(2 * np.hypot(*streak)))
        for part in (np.arange(steps) + 0.5) / steps - 0.5:
            du, dv = columns - (u + part * streak[0]), rows - (v + part * streak[1])
            spread = np.exp(-0.5 * (du * du + dv * dv) / width**2)
            light += total / steps / (2 * np.pi * width**2) * spread
    electrons = rng.poisson(np.maximum(light, 0.0) * 25.0) + rng.normal(0.0, 25.0, shape)
    return np.clip(np.rint(electrons * 0.04), 0, 255).astype(np.uint8)


@given(
    seed=st.integers(0, 2**32 - 1),
    shape=st.tuples(st.integers(32, 130), st.integers(32, 150)),
    stars=st.integers(0, 12),
    background=st.sampled_from([0.0, 3.0, 10.0, 60.0, 180.0, 225.0]),
    streak=st.sampled_from([(0.0, 0.0), (6.0, -3.0), (0.0, 14.0), (25.0, 11.0)]),
    width=st.sampled_from([0.5, 1.2, 2.5]),
    slope=st.sampled_from([0.0, 40.0]),
)
@settings(max_examples=60)
def test_rendered_skies(both, seed, shape, stars, background, streak, width, slope):
    rng = np.random.default_rng(seed)
    flux = (100.0, 30_000.0) if seed % 3 == 0 else (100.0, 3000.0)  # a third with saturated stars
    assert_equal_spots(both, sky(rng, shape, stars, background, streak, flux, width, slope))


@given(
    seed=st.integers(0, 2**32 - 1),
    shape=st.tuples(st.integers(32, 90), st.integers(32, 90)),
    kind=st.sampled_from(["noise", "salt", "blocks", "coarse", "halves", "stripes"]),
    share=st.sampled_from([0.001, 0.01, 0.05, 0.15]),
    low=st.integers(0, 255),
)
@settings(max_examples=80)
def test_pictures_of_no_sky(both, seed, shape, kind, share, low):
    rng = np.random.default_rng(seed)
    image = np.full(shape, low, np.uint8)
    if kind == "noise":
        image = np.clip(rng.normal(low, 20.0, shape), 0, 255).astype(np.uint8)
    elif kind == "salt":
        image[rng.random(shape) < share] = 255
    elif kind == "blocks":
        for _ in range(rng.integers(1, 20)):
            v, u = rng.integers(0, shape[0]), rng.integers(0, shape[1])
            image[v : v + rng.integers(1, 9), u : u + rng.integers(1, 9)] = rng.integers(0, 256)
    elif kind == "coarse":
        image = cv2.resize(rng.integers(0, 256, (5, 6), dtype=np.uint8), shape[::-1])
    elif kind == "halves":
        image[:, shape[1] // 2 :] = 255 - low
    else:
        image[:: rng.integers(2, 40)] = 255
        image[:, :: rng.integers(2, 40)] = rng.integers(0, 256)
    assert_equal_spots(both, image)


@pytest.mark.parametrize("level", [0, 1, 127, 254, 255])
def test_pictures_of_one_level_hold_nothing(both, level):
    assert len(assert_equal_spots(both, np.full((480, 640), level, np.uint8))) == 0


def test_a_whole_frame_has_the_same_spots(both, painter):
    spots = assert_equal_spots(both, painter.paint(np.random.default_rng(1), (2.5, 2.0, 0.4)))
    assert len(spots) > 20
    moving = painter.paint(np.random.default_rng(2), (2.5, 2.0, 0.4), (0.6, 0.2, 1.5), exposure_s=0.04)
    blurred = assert_equal_spots(both, moving)
    assert blurred.elongation.max() > 2.0


def test_a_lamp_is_centred_by_its_moments(both):
    image = sky(np.random.default_rng(7), (240, 320), 10, 12.0, flux=(1000.0, 3000.0))
    lamp = cv2.line(np.zeros_like(image), (60, 80), (250, 130), 120, 14)  # a tube of 2800 pixels
    spots = assert_equal_spots(both, np.maximum(image, lamp))
    assert abs(spots.u_px[0] - 155.0) + abs(spots.v_px[0] - 105.0) < 1.0
    assert spots.flux_dn[0] > 1e5


@pytest.mark.parametrize("shape", [(32, 32), (33, 47), (100, 32), (48, 640), (241, 323)])
def test_sizes_that_no_cell_divides(both, shape):
    assert len(assert_equal_spots(both, sky(np.random.default_rng(5), shape, 4, 12.0))) > 0


def test_rows_that_lie_apart_and_columns_turned_round(both, painter):
    image = painter.paint(np.random.default_rng(3), (2.5, 2.0, 1.0))
    cut = image[40:440, 100:500]
    assert not cut.flags.c_contiguous
    for view in (cut, image[::-1], image[:, ::-1], image.T, image[::2, ::2], np.asfortranarray(image)):
        whole = both[0].find(np.ascontiguousarray(view))
        assert np.array_equal(both[0].find(view).u_px, whole.u_px)
        assert_equal_spots(both, view)


def test_spots_are_kept_when_the_next_picture_comes(both, painter):
    first = both[0].find(painter.paint(np.random.default_rng(4), (2.5, 2.0, 1.0)))
    before = [
        getattr(first, name).copy() for name in ("u_px", "v_px", "flux_dn", "covariance_px2", "streak_px")
    ]
    both[0].find(painter.paint(np.random.default_rng(5), (2.0, 1.5, -1.0)))
    after = [first.u_px, first.v_px, first.flux_dn, first.covariance_px2, first.streak_px]
    assert all(np.array_equal(a, b) for a, b in zip(before, after, strict=True))


@pytest.mark.parametrize("count", [0, 1, 5])
def test_only_the_brightest_are_kept(painter, count):
    image = painter.paint(np.random.default_rng(6), (2.5, 2.0, 0.4))
    chosen = DetectorSettings(max_spots=count)
    few = assert_equal_spots((Detector(chosen), OracleDetector(chosen)), image)
    assert len(few) == count
    everything = detect(image)
    far = np.hypot(few.u_px[:, None] - everything.u_px, few.v_px[:, None] - everything.v_px)
    # The width is that of the kept spots, so centres may move a little.
    assert count == 0 or far.min(axis=1).max() < 0.05
    assert (few.flux_dn >= 0.8 * everything.flux_dn[max(count - 1, 0)]).all()


def test_a_picture_with_more_light_than_a_sky_is_flooded_in_both():
    image = np.zeros((128, 128), np.uint8)
    image[8::16, 8::16] = 255  # 64 points, 5x5 pixels lit of each or fewer
    for ratio, flooded in ((0.12, False), (0.03, True)):
        chosen = DetectorSettings(max_lit_ratio=ratio)
        spots = assert_equal_spots((Detector(chosen), OracleDetector(chosen)), image)
        assert spots.is_flooded is flooded


@pytest.mark.parametrize(
    "image",
    [
        np.zeros((64, 64, 3), np.uint8),
        np.zeros((64, 64), np.int8),
        np.zeros((31, 64), np.uint8),
        np.zeros(64),
    ],
)
def test_what_is_no_picture_is_refused(image):
    with pytest.raises(PictureError, match="expected"):
        detect(image)


@pytest.mark.parametrize(
    "wrong", [{"max_spots": -1}, {"max_lit_ratio": 1.5}, {"max_lit_ratio": float("nan")}]
)
def test_limits_that_are_none_are_refused(wrong):
    with pytest.raises(ValueError, match="max_spots of 0 or more"):
        DetectorSettings(**wrong)


@pytest.mark.slow
def test_wider_vectors_give_the_same_bits(painter, tmp_path, monkeypatch):
    plain = load_core(compile_core(tmp_path, ("-DGS_NO_CLONES", "-Werror")))
    wide = Detector()
    monkeypatch.setattr(detection, "default_core", lambda: plain)
    narrow = Detector()
    for velocity in ((0.0, 0.0, 0.0), (0.6, 0.2, 1.5)):
        image = painter.paint(np.random.default_rng(9), (2.5, 2.0, 0.4), velocity, exposure_s=0.04)
        one, two = wide.find(image), narrow.find(image)
        assert len(one) > 10
        for name in ("u_px", "v_px", "flux_dn", "covariance_px2", "elongation", "streak_px"):
            assert np.array_equal(getattr(one, name), getattr(two, name)), name
