import numpy as np
import pytest

from firmware_emulator.sky.sensor import Sensor, SensorSettings
from firmware_emulator.sky.spots import add_spots, steps_of

SEED = np.random.SeedSequence(11)


def flat(level_dn):
    return np.full((480, 640), level_dn, dtype=np.float32)


@pytest.mark.parametrize("level_dn", [0.0, 20.0, 100.0])
def test_noise_is_read_noise_and_shot_noise_and_rounding(level_dn):
    chip = Sensor(SensorSettings(hot_pixels=0, black_dn=20.0), 480, 640, SEED)
    image = chip.expose(flat(level_dn), 0).astype(float)
    variance = (25.0 / 20.0) ** 2 + level_dn / 20.0 + 1 / 12
    assert np.mean(image) == pytest.approx(level_dn + 20.0, abs=0.02)
    assert np.var(image) == pytest.approx(variance, rel=0.02)


def test_noise_of_neighbouring_pixels_and_frames_is_independent():
    chip = Sensor(SensorSettings(hot_pixels=0, black_dn=20.0), 480, 640, SEED)
    one, other = (chip.expose(flat(0.0), k).astype(float) - 20.0 for k in (0, 1))
    limit = 5.0 / np.sqrt(one.size)
    for a, b in [(one[:, 1:], one[:, :-1]), (one[1:], one[:-1]), (one, other)]:
        assert abs(np.corrcoef(a.ravel(), b.ravel())[0, 1]) < limit


def test_hot_pixels_stay_where_they_are_and_can_be_replaced():
    chip = Sensor(SensorSettings(), 480, 640, SEED)
    rows, columns, level_dn = chip.hot_pixels
    assert len(rows) == 25
    for k in range(3):
        image = chip.expose(flat(0.0), k)
        np.testing.assert_allclose(image[rows, columns], np.minimum(level_dn + 5.0, 255), atol=20.0)
    chip.hot_pixels = (np.array([7]), np.array([9]), np.array([120.0], dtype=np.float32))
    image = chip.expose(flat(0.0), 0)
    assert np.argwhere(image > 60).tolist() == [[7, 9]]
    with pytest.raises(ValueError, match="inside the picture"):
        chip.hot_pixels = (np.array([480]), np.array([9]), np.array([120.0], dtype=np.float32))


@pytest.mark.parametrize("bad", [{"gain_e_dn": 0.0}, {"psf_sigma_px": -1.0}, {"read_noise_e": -1.0}])
def test_an_impossible_chip_is_refused(bad):
    with pytest.raises(ValueError, match="must"):
        SensorSettings(**bad)


@pytest.mark.parametrize("streak_px", [0.0, 1.1, 14.5, 37.0, 400.0])
def test_steps_are_dense_enough_and_fill_their_patches(streak_px):
    steps = steps_of(streak_px, 1.2)
    assert steps * 1.2 >= streak_px
    pieces = -(-steps // 12)
    assert steps % pieces == 0


def test_a_streak_is_as_smooth_as_the_exact_integral():
    light = np.zeros((60, 90), dtype=np.float32)
    length_px, sigma_px = 40.0, 1.2
    steps = steps_of(length_px, sigma_px)
    share = (np.arange(steps) + 0.5) / steps
    path = np.column_stack([20.3 + length_px * share, np.full(steps, 30.1)])[None]
    add_spots(light, path, np.array([4000.0]), sigma_px)
    along = light[:, 30:52].sum(axis=0)  # far from both ends
    np.testing.assert_allclose(along, 4000.0 / length_px, rtol=2e-3)
    assert light.sum() == pytest.approx(4000.0, rel=2e-4)


def test_spots_that_overlap_add_up():
    light = np.zeros((40, 40), dtype=np.float32)
    add_spots(light, np.array([[[20.0, 20.0]], [[21.0, 20.0]]]), np.array([100.0, 300.0]), 1.2)
    one, other = np.zeros_like(light), np.zeros_like(light)
    add_spots(one, np.array([[[20.0, 20.0]]]), np.array([100.0]), 1.2)
    add_spots(other, np.array([[[21.0, 20.0]]]), np.array([300.0]), 1.2)
    np.testing.assert_allclose(light, one + other, rtol=1e-5, atol=1e-5)
