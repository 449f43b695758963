import numpy as np
import pytest

from calibration.imu.gyro_scale import gyro_scale
from calibration.imu.temperature import temperature_slope


def a_warm_up(seed: int = 0, seconds: int = 600, span_c: float = 5.0, walk: float = 0.0):
    rng = np.random.default_rng(seed)
    n = seconds * 20
    t = np.arange(1, n + 1) * 0.05
    warmth = 24.0 + span_c * (1 - np.exp(-t / 150.0))
    slope = np.array([3e-4, -2e-4, 4e-4])
    readings = 0.01 + warmth[:, None] * slope + rng.normal(0.0, 3e-4, (n, 3))
    readings += np.cumsum(rng.normal(0.0, walk, (n, 3)), axis=0)
    return t, readings, np.round(warmth / 0.145) * 0.145, slope


@pytest.mark.parametrize("walk", [0.0, 4e-6])
def test_the_slope_is_within_its_own_sigma_over_seeds(walk):
    ratio = []
    for seed in range(25):
        t, readings, warmth, slope = a_warm_up(seed, walk=walk)
        found = temperature_slope(t, readings, warmth)
        ratio.append((found.slope - slope) / found.slope_sigma)
    assert np.sqrt(np.mean(np.square(ratio))) < 1.6


def test_wild_packets_do_not_bend_the_slope():
    t, readings, warmth, slope = a_warm_up()
    readings[-50::7] += 1.0
    np.testing.assert_allclose(temperature_slope(t, readings, warmth).slope, slope, atol=1.5e-5)


def test_a_rest_at_one_temperature_tells_no_slope():
    t, readings, warmth, _ = a_warm_up(span_c=0.2)
    with pytest.raises(ValueError, match="changed by"):
        temperature_slope(t, readings, warmth)


def test_without_a_thermometer_there_is_no_slope():
    t, readings, warmth, _ = a_warm_up()
    with pytest.raises(ValueError, match="no temperatures"):
        temperature_slope(t, readings, warmth * np.nan)


def a_spin(seed: int = 0, scale: float = 0.012, seconds: float = 60.0, wrong: int = 0):
    rng = np.random.default_rng(seed)
    n = round(seconds * 100)
    t = np.arange(1, n + 1) * 0.01
    rate = 0.7 * np.sign(np.sin(2 * np.pi * t / 40.0 + 0.3))
    reading = rate / (1 - scale) - 0.006 + rng.normal(0.0, 7e-4, n)
    heading = np.cumsum(rate * 0.01)
    fix_t = np.arange(1.0, seconds, 0.667)
    stars = np.interp(fix_t, t, heading) + rng.normal(0.0, 9e-4, len(fix_t))
    picked = rng.choice(len(fix_t), wrong, replace=False)
    stars[picked] += rng.uniform(-3, 3, wrong)
    stars = np.angle(np.exp(1j * stars))
    return t, np.full(n, 0.01), reading, fix_t, stars


def test_the_scale_is_within_its_own_sigma_over_seeds():
    ratio = []
    for seed in range(30):
        found = gyro_scale(*a_spin(seed), null_rad_s=-0.005)
        ratio.append((found.scale - 0.012) / found.scale_sigma)
        assert found.null_rad_s == pytest.approx(-0.006, abs=1e-4)
    assert 0.6 < np.std(ratio) < 2.5


def test_wrong_fixes_are_trimmed():
    found = gyro_scale(*a_spin(5, wrong=9), null_rad_s=-0.006)
    assert found.scale == pytest.approx(0.012, abs=5e-4)
    assert 7 <= found.refused <= 12


def test_less_than_a_turn_is_refused():
    t, span, reading, fix_t, stars = a_spin()
    with pytest.raises(ValueError, match="full turn"):
        gyro_scale(t, span, reading * 0.01, fix_t, stars, null_rad_s=0.0)
