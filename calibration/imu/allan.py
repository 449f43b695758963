"""Overlapping Allan deviation of a rate, with the random walk and bias instability read off it.

sigma^2(tau) = 1 / (2 tau^2 (N - 2 m)) sum (theta_{k+2m} - 2 theta_{k+m} + theta_k)^2, theta being the
integrated rate (W. J. Riley, Handbook of Frequency Stability Analysis, NIST SP 1065, 2008, section 5.2.4).
The bracket over tau is the difference of two neighbouring means. Lost packets are not made up: a mean is that
of the packets that are there, and a difference of means of fewer is scaled as white noise asks.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.outcome import CalibrationRefusedError
from groundstation.fusion.stamp_ticks import StampTicks

Array = NDArray[np.float64]

FLICKER_FLOOR = math.sqrt(2.0 * math.log(2.0) / math.pi)
"""Allan deviation of flicker noise over its coefficient (IEEE Std 952-1997, annex C)."""
LEAST_READINGS = 64
LEAST_PAIRS = 9
"""Below this many independent differences the deviation is a guess (30 % of itself)."""
LEAST_SHARE = 0.5
"""Of the packets that a mean needs."""
SPLIT_S = 1.0
"""A longer hole ends a stretch."""
SEEN_SIGMAS = 2.0
"""By so many the curve has to rise again behind its lowest point, and to lie above the white noise there."""


@dataclass(frozen=True, slots=True, eq=False)
class AllanDeviation:
    """Allan deviation of one channel, in the channel's unit."""

    tau_s: Array
    deviation: Array
    sigma: Array
    """Of the deviation itself, for white noise."""
    random_walk: float
    """White noise density: the deviation at 1 s on the slope of -1/2; channel unit times sqrt(s)."""
    random_walk_sigma: float
    bias_instability: float
    """Lowest deviation over 0.664; an upper limit unless the floor is seen."""
    bias_instability_sigma: float
    bias_instability_tau_s: float
    is_floor_seen: bool
    """Whether the curve turned up again, so that the instability is more than an upper limit."""


def stretches_on_ticks(t_s: Array, readings: Array, period_s: float) -> tuple[list[Array], float]:
    """Return evenly spaced readings (m, c) of each stretch without a long hole, and their spacing as it was.

    Each packet stands at its tick; where one was lost there is NaN.

    Args:
        t_s: (n,) rising stamps.
        readings: (n, c).
        period_s: Nominal spacing.
    """
    ticks = StampTicks(period_s)
    windows = np.round([ticks.elapsed_s(t) / period_s for t in t_s.tolist()]).astype(np.int64)
    place = np.cumsum(windows)
    inside = windows[1:] * period_s <= SPLIT_S
    spacing = float(np.diff(t_s)[inside].sum() / windows[1:][inside].sum()) if inside.any() else period_s
    stretches = []
    for rows in np.split(np.arange(len(t_s)), np.flatnonzero(~inside) + 1):
        at = place[rows] - place[rows[0]]
        even = np.full((int(at[-1]) + 1, readings.shape[1]), np.nan)
        even[at] = readings[rows]
        stretches.append(even)
    return stretches, spacing


def overlapping_deviation(stretches: Sequence[Array], factors: NDArray[np.int_]) -> Array:
    """Return the overlapping Allan deviation for averaging over `factors` samples each.

    Args:
        stretches: Evenly spaced readings, (n,) each, NaN where one is missing.
        factors: (k,) samples.
    """
    square, count = np.zeros(len(factors)), np.zeros(len(factors))
    for stretch in stretches:
        is_there = np.isfinite(stretch)
        if not is_there.any():
            continue
        level = float(stretch[is_there].mean())
        total = np.concatenate([[0.0], np.cumsum(np.where(is_there, stretch - level, 0.0))])
        there = np.concatenate([[0], np.cumsum(is_there)])
        for k, m in enumerate(factors.tolist()):
            if len(stretch) < 2 * m:
                continue
            packets = there[m:] - there[:-m]
            mean = (total[m:] - total[:-m]) / np.maximum(packets, 1)
            first, second = packets[:-m], packets[m:]
            good = np.minimum(first, second) > LEAST_SHARE * m
            first, second = first[good], second[good]
            scale = 2.0 * first * second / (m * (first + second))
            square[k] += float(((mean[m:] - mean[:-m])[good] ** 2 * scale).sum())
            count[k] += int(good.sum())
    return np.asarray(np.sqrt(square / (2.0 * np.maximum(count, 1.0))))


def allan_deviation(
    stretches: Sequence[Array], period_s: float, points_per_decade: int = 10
) -> AllanDeviation:
    """Return the Allan deviation over all averaging times that the record supports.

    Args:
        stretches: Evenly spaced readings, (n,) each, NaN where one is missing.
        period_s: their spacing.
        points_per_decade: averaging times per factor of ten.

    Raises:
        CalibrationRefusedError: fewer than 64 readings.
    """
    sizes = np.array([len(stretch) for stretch in stretches])
    n = int(sum(np.isfinite(stretch).sum() for stretch in stretches))
    if n < LEAST_READINGS:
        raise CalibrationRefusedError(
            f"an Allan deviation needs at least {LEAST_READINGS} readings, found {n}"
        )
    longest = max(2, int(sizes.max()) // 2)
    steps = max(2, round(points_per_decade * math.log10(longest)) + 1)
    factors = np.unique(np.round(np.geomspace(1, longest, steps)).astype(int))
    pairs = np.array([np.maximum(sizes // m - 1, 0).sum() for m in factors])
    factors, pairs = factors[pairs >= LEAST_PAIRS], pairs[pairs >= LEAST_PAIRS]
    if not len(factors):
        raise CalibrationRefusedError("the record is in pieces that are too short for an Allan deviation")
    deviation = overlapping_deviation(stretches, factors)
    tau = factors * period_s
    sigma = deviation / np.sqrt(2.0 * pairs)
    lowest = int(np.argmin(deviation))
    white, white_sigma = _white_density(tau, deviation, sigma, lowest)
    floor, doubt = float(deviation[lowest]), float(sigma[lowest])
    rises = bool((deviation[lowest + 1 :] - SEEN_SIGMAS * sigma[lowest + 1 :] > floor).any())
    expected = white / math.sqrt(float(tau[lowest])) if math.isfinite(white) else 0.0
    is_seen = rises and floor - SEEN_SIGMAS * doubt > expected
    return AllanDeviation(
        tau, deviation, sigma, white, white_sigma, floor / FLICKER_FLOOR, doubt / FLICKER_FLOOR,
        float(tau[lowest]), is_seen,
    )  # fmt: skip


def _white_density(tau: Array, deviation: Array, sigma: Array, lowest: int) -> tuple[float, float]:
    """Fit the slope of -1/2 left of the minimum, where the logarithmic slope is near it; or NaN."""
    if len(tau) < 2:
        return math.nan, math.nan
    slope = np.gradient(np.log(deviation), np.log(tau))
    rows = (np.arange(len(tau)) <= lowest) & (np.abs(slope + 0.5) < 0.2)
    if not rows.any():
        return math.nan, math.nan
    weight = (deviation[rows] / sigma[rows]) ** 2
    logs = np.log(deviation[rows] * np.sqrt(tau[rows]))
    white = math.exp(float(np.sum(weight * logs) / np.sum(weight)))
    return white, white / math.sqrt(float(weight.max()))  # the averaging times share their packets
