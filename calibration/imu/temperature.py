"""Temperature slopes of the zero offsets from a long rest that warms up or cools down."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.outcome import CalibrationRefusedError

Array = NDArray[np.float64]

BLOCK_S = 5.0
"""Long against the thermometer's steps, short against warming; offsets wander little within."""
LEAST_SPAN_C = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class TemperatureSlope:
    """Offset = at_reference + slope (T - reference), for each channel that was given."""

    slope: Array
    """(c,) per degree."""
    slope_sigma: Array
    at_reference: Array
    reference_c: float
    span_c: float
    residual_rms: Array
    """(c,) of the block means."""
    block_t_s: Array
    block_temperature_c: Array
    block_mean: Array
    """(m, c)."""


def temperature_slope(t_s: Array, readings: Array, temperature_c: Array) -> TemperatureSlope:
    """Fit a straight line to block means; a block's median is used, so wild packets do not count.

    An offset wanders by itself while it warms; the fit weighs the blocks by white noise plus a random walk,
    both read off the residual, and the sigma of the slope is that fit's.

    Args:
        t_s: (n,) stamps of a rest, ascending.
        readings: (n, c) rate rad/s, ax, ay m/s^2, or those of them that are alive.
        temperature_c: (n,).

    Raises:
        CalibrationRefusedError: no thermometer, too short, or hardly any change of temperature.
    """
    known = np.isfinite(temperature_c) & np.isfinite(readings).all(axis=1)
    if not known.any():
        raise CalibrationRefusedError("the recording holds no temperatures")
    t, values, warmth = t_s[known], readings[known], temperature_c[known]
    block = np.floor((t - t[0]) / BLOCK_S).astype(int)
    labels = np.unique(block)
    if len(labels) < 8:
        raise CalibrationRefusedError(f"at least {8 * BLOCK_S:g} s are needed, found {t[-1] - t[0]:.0f} s")
    means = np.array([np.median(values[block == k], axis=0) for k in labels])
    # packets averaged per block: their mean is quieter than the median, which only guards against wild ones
    spread = np.array([1.4826 * np.median(np.abs(values[block == k] - m), axis=0)
                       for k, m in zip(labels, means, strict=True)])  # fmt: skip
    for k, label in enumerate(labels):
        rows = values[block == label]
        tame = (np.abs(rows - means[k]) <= 6.0 * spread[k] + 1e-12).all(axis=1)
        if tame.any():
            means[k] = rows[tame].mean(axis=0)
    heat = np.array([warmth[block == k].mean() for k in labels])
    when = np.array([t[block == k].mean() for k in labels])
    span = float(np.ptp(heat))
    if span < LEAST_SPAN_C:
        raise CalibrationRefusedError(
            f"the temperature changed by {span:.2f} C only; {LEAST_SPAN_C:g} C are needed"
        )
    reference = float(heat.mean())
    A = np.column_stack([np.ones_like(heat), heat - reference])
    channels = means.shape[1]
    found, sigma, left = np.zeros((2, channels)), np.zeros(channels), np.zeros_like(means)
    for c in range(channels):
        found[:, c], sigma[c] = _weighted(A, means[:, c])
        left[:, c] = means[:, c] - A @ found[:, c]
    rms = np.sqrt((left**2).mean(axis=0))
    return TemperatureSlope(found[1], sigma, found[0], reference, span, rms, when, heat, means)


def _weighted(A: Array, y: Array) -> tuple[Array, float]:
    """Fit y = A x with errors that are white plus a random walk, both sized from the residual."""
    m = len(y)
    plain, *_ = np.linalg.lstsq(A, y, rcond=None)
    left = y - A @ plain
    lag = max(2, m // 8)
    near = float(np.mean(np.diff(left) ** 2))
    far = float(np.mean((left[lag:] - left[:-lag]) ** 2))
    # the mean square of differences grows as 2 white + lag * walk
    walk = max(0.0, (far - near) / (lag - 1))
    white = max(0.5 * (near - walk), 1e-3 * near, 1e-30)
    step = np.arange(m)
    covariance = white * np.eye(m) + walk * np.minimum.outer(step, step)
    root = np.linalg.cholesky(covariance)
    B, z = np.linalg.solve(root, A), np.linalg.solve(root, y)
    normal = B.T @ B
    return np.linalg.solve(normal, B.T @ z), math.sqrt(float(np.linalg.inv(normal)[1, 1]))
