"""Means of polls that a sensor rounds: how far off they are, and how much noise one poll has.

Noise well above a step makes the mean of rounded polls true. Below, it is off by up to half a step and
scatters unevenly, depending on where between two steps the quantity lies
(Widrow and Kollar, Quantization Noise, 2008); the scatter of a mean no longer states the noise of a poll.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import ndtr

Array = NDArray[np.float64]

_REACH = 5.0
_LEAST, _MOST = 0.05, 50.0
"""Noise of a poll that is looked for, in steps."""
_LOOKED_AT = 20_000


@dataclass(frozen=True, slots=True, eq=False)
class Rounded:
    """What becomes of a quantity when it is rounded with noise; all in steps of the converter.

    Attributes:
        bias: (n,) mean of what is read less the quantity.
        variance: (n,) of one poll.
    """

    bias: Array
    variance: Array


def rounded(value: Array, noise: float) -> Rounded:
    """Round (n,) values plus Gaussian noise."""
    if noise > 2.0:  # as if it were not rounded: the bias is below 1e-17 of a step
        return Rounded(np.zeros(len(value)), np.full(len(value), noise**2 + 1.0 / 12.0))
    whole = np.rint(value)
    phase, reach = value - whole, math.ceil(_REACH * noise + 1.0)
    code = np.arange(-reach, reach + 1.0)
    above = (code[:-1] + 0.5 - phase[:, None]) / noise
    share = np.diff(ndtr(above), axis=1, prepend=0.0, append=1.0)
    mean = share @ code
    variance = share @ code**2 - mean**2
    return Rounded(mean - phase, variance)


def noise_of_poll(value: Array, variance: float, polls: int) -> tuple[float, float]:
    """Noise of one poll before rounding, in steps, and its derivative by the variance.

    Args:
        value: (n,) what was read, in steps.
        variance: Of means of ``polls`` rounded polls about their expectation, steps^2.
        polls: In a window.

    Returns:
        NaNs where no noise scatters so.
    """
    looked_at = value[:: max(1, len(value) // _LOOKED_AT)]

    def excess(noise: float) -> float:
        return float(rounded(looked_at, noise).variance.mean()) / polls - variance

    if not excess(_LEAST) < 0.0 < excess(_MOST):
        return math.nan, math.nan
    noise = float(brentq(excess, _LEAST, _MOST, xtol=1e-5))
    step = 1e-3 * noise
    return noise, 2.0 * step / (excess(noise + step) - excess(noise - step))
