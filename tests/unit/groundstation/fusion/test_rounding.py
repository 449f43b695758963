"""What rounding does to the mean of polls, against drawn polls."""

import math

import numpy as np
import pytest

from groundstation.fusion.noise import STEADY_S, rounding_walk


@pytest.mark.parametrize("steps_of_noise", [0.3, 0.41, 0.6])
def test_the_rounding_of_means_is_as_large_as_drawn(steps_of_noise):
    rng = np.random.default_rng(3)
    rates = np.linspace(0.0, 1.0, 21)[:-1]
    off = [np.round(rate + rng.normal(0.0, steps_of_noise, 400_000)).mean() - rate for rate in rates]
    rms = np.sqrt(np.mean(np.square(off)))
    walk = rounding_walk(steps_of_noise, 1.0)
    assert walk * math.sqrt(STEADY_S / 2.0) == pytest.approx(rms, rel=0.1, abs=2e-3)


def test_noise_above_a_step_hides_the_steps():
    assert rounding_walk(3.2, 1.0) < 1e-80
    assert rounding_walk(1.0, 0.0) == 0.0
