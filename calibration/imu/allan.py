"""Overlapping Allan deviation of a rate, with the random walk and bias instability read off it.

sigma^2(tau) = 1 / (2 tau^2 (N - 2 m)) sum (theta_{k+2m} - 2 theta_{k+m} + theta_k)^2, theta being the
integrated rate (W. J. Riley, Handbook of Frequency Stability Analysis, NIST SP 1065, 2008, section 5.2.4).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.outcome import CalibrationRefusedError

Array = NDArray[np.float64]

FLICKER_FLOOR = math.sqrt(2.0 * math.log(2.0) / math.pi)
"""Allan deviation of flicker noise over its coefficient (IEEE Std 952-1997, annex C)."""
LEAST_PAIRS = 9
"""Below this many independent differences the deviation is a guess (30 % of itself)."""


@dataclass(frozen=True, slots=True, eq=False)
class AllanDeviation:
    """Allan deviation of one channel, in the channel's unit."""

    tau_s: Array
    deviation: Array
    sigma: Array
    """Of the deviation itself, for white noise."""
    random_walk: float
    """White noise density: the deviation at 1 s on the slope of -1/2; channel unit times sqrt(s)."""
    bias_instability: float
    """Lowest deviation over 0.664; an upper limit if the curve still falls."""
    bias_instability_tau_s: float
    is_floor_seen: bool
    """Whether the curve turned up again, so that the instability is more than an upper limit."""


def overlapping_deviation(rate: Array, period_s: float, factors: NDArray[np.int_]) -> Array:
    """Return the overlapping Allan deviation for averaging over `factors` samples each."""
    theta = np.concatenate([[0.0], np.cumsum(rate - np.mean(rate))]) * period_s
    out = np.empty(len(factors))
    for k, m in enumerate(factors):
        second = theta[2 * m :] - 2.0 * theta[m:-m] + theta[: -2 * m]
        tau = m * period_s
        out[k] = math.sqrt(float(np.mean(second**2)) / 2.0) / tau
    return out


def allan_deviation(rate: Array, period_s: float, points_per_decade: int = 10) -> AllanDeviation:
    """Return the Allan deviation over all averaging times that the record supports.

    Args:
        rate: (n,) evenly spaced readings; holes must have been bridged.
        period_s: their spacing.
        points_per_decade: averaging times per factor of ten.

    Raises:
        CalibrationRefusedError: fewer than 64 readings.
    """
    n = len(rate)
    if n < 64:
        raise CalibrationRefusedError(f"an Allan deviation needs at least 64 readings, found {n}")
    longest = n // (LEAST_PAIRS + 1)
    steps = max(2, round(points_per_decade * math.log10(longest)) + 1)
    factors = np.unique(np.round(np.geomspace(1, longest, steps)).astype(int))
    deviation = overlapping_deviation(rate, period_s, factors)
    tau = factors * period_s
    sigma = deviation / np.sqrt(2.0 * np.maximum(n / factors - 1.0, 1.0))
    lowest = int(np.argmin(deviation))
    white = _white_density(tau, deviation, sigma, lowest)
    turned = bool((deviation[lowest + 1 :] > 1.15 * deviation[lowest]).any())
    floor = float(deviation[lowest]) / FLICKER_FLOOR
    return AllanDeviation(tau, deviation, sigma, white, floor, float(tau[lowest]), turned)


def _white_density(tau: Array, deviation: Array, sigma: Array, lowest: int) -> float:
    """Fit the slope of -1/2 left of the minimum, where the logarithmic slope is near it."""
    slope = np.gradient(np.log(deviation), np.log(tau))
    rows = (np.arange(len(tau)) <= lowest) & (np.abs(slope + 0.5) < 0.2)
    if not rows.any():
        return math.nan
    weight = (deviation[rows] / sigma[rows]) ** 2
    logs = np.log(deviation[rows] * np.sqrt(tau[rows]))
    return math.exp(float(np.sum(weight * logs) / np.sum(weight)))


def bridge_holes(t_s: Array, readings: Array, period_s: float) -> Array:
    """Return evenly spaced readings (m, c): each packet at its tick, lost packets interpolated."""
    tick = np.round((t_s - t_s[0]) / period_s).astype(int)
    tick, first = np.unique(tick, return_index=True)
    grid = np.arange(tick[-1] + 1)
    return np.column_stack([np.interp(grid, tick, column[first]) for column in readings.T])
