"""The camera's delay from turn rates and headings whose delay is known."""

import numpy as np
import pytest

from calibration.sky.delay_fit import camera_delay

PERIOD_S = 0.004


def recording(rng, delay_s=0.087, rate_sigma=0.01, heading_sigma=1e-3, bias=0.004):
    """A mock-up that turns to and fro; each gyro sample is the mean over the window that ends at its time."""
    t = np.arange(PERIOD_S, 30.0, PERIOD_S)

    def angle(at):
        return 0.8 * np.sin(1.1 * at) + 0.2 * np.sin(3.1 * at)

    rate = (angle(t) - angle(t - PERIOD_S)) / PERIOD_S + bias + rng.normal(0.0, rate_sigma, len(t))
    exposure = np.arange(2.0, 28.0, 0.21)
    heading = angle(exposure) + 2.9 + rng.normal(0.0, heading_sigma, len(exposure))
    return t, rate, exposure + delay_s, np.angle(np.exp(1j * heading))


def test_delay_and_gyro_bias_are_found_within_their_spread():
    rng = np.random.default_rng(1)
    ratios = []
    for _ in range(30):
        found = camera_delay(*recording(rng), guess_s=0.05)
        assert found.gyro_bias_rad_s == pytest.approx(0.004, abs=5e-4)  # sum of 26 s: 1.2e-4
        ratios.append((found.delay_s - 0.087) / found.sigma_s)
    assert 0.7 < np.sqrt(np.mean(np.square(ratios))) < 1.35
    assert found.sigma_s < 2e-3


def test_wrong_headings_are_left_out():
    rng = np.random.default_rng(2)
    t, rate, arrival, heading = recording(rng)
    heading[::9] += rng.uniform(0.3, 2.0, len(heading[::9]))
    found = camera_delay(t, rate, arrival, heading, guess_s=0.1)
    assert found.delay_s == pytest.approx(0.087, abs=2e-3)
    assert not found.used[::9].any()


def test_what_cannot_show_a_delay_is_refused_in_words():
    t = np.arange(0.0, 20.0, 0.01)
    arrival = np.arange(2.0, 18.0, 0.5)
    with pytest.raises(ValueError, match="changes too little"):
        camera_delay(t, np.zeros(len(t)), arrival, np.zeros(len(arrival)))
    with pytest.raises(ValueError, match="must rise"):
        camera_delay(t[::-1], np.zeros(len(t)), arrival, np.zeros(len(arrival)))
    with pytest.raises(ValueError, match="headings lie inside"):
        camera_delay(t, np.zeros(len(t)), arrival + 100.0, np.zeros(len(arrival)))
