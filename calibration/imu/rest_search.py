"""Where in a recording the block stood still: the stretches between being turned, tilted or carried."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from calibration.imu.zero_offset import packet_sigma
from calibration.outcome import CalibrationRefusedError

Array = NDArray[np.float64]

BLOCK_S = 0.25
LOUD = 2.0
"""A block that spreads wider than this times the packets' own noise is moved, or struck."""
STEP_SIGMAS = 8.0
"""Neighbouring blocks whose means lie further apart than this belong to two rests."""
BRIDGE_BLOCKS = 2
"""A knock this short does not end a rest, if it goes on where it was."""


def find_rests(
    t_s: Array, readings: Array, least_s: float, loudest: Array | None = None
) -> list[tuple[float, float]]:
    """Return start and end of every stretch of at least `least_s` in which nothing moved.

    Args:
        t_s: (n,) stamps, ascending.
        readings: (n, 3) rate rad/s, ax, ay m/s^2.
        least_s: shorter ones are left out.
        loudest: (3,) sigma of one packet beyond which the sensors' own noise cannot be; None if unknown.

    Raises:
        CalibrationRefusedError: fewer than eight packets.
    """
    if len(t_s) < 8:
        raise CalibrationRefusedError(f"at least 8 packets are needed, found {len(t_s)}")
    period = float(np.median(np.diff(t_s)))
    size = max(4, round(BLOCK_S / period))
    count = len(t_s) // size
    sigma = packet_sigma(readings)
    if loudest is not None:
        sigma = np.minimum(sigma, loudest)
    blocks = readings[: count * size].reshape(count, size, 3)
    ends = t_s[: count * size].reshape(count, size)
    means = np.median(blocks, axis=1)
    # a median of squares is deaf to the odd wild packet
    spread = 1.4826 * np.median(np.abs(blocks - means[:, None]), axis=1)
    steady = (spread <= LOUD * np.maximum(sigma, 1e-12)).all(axis=1)
    steady &= np.ptp(ends, axis=1) < 2.0 * size * period
    # the gyro's null is where most quiet blocks read; a block that turns evenly is no rest
    if steady.any():
        null = float(np.median(means[steady, 0]))
        turning = np.abs(means[:, 0] - null) > STEP_SIGMAS * sigma[0] / math.sqrt(size) + 2e-3
        steady &= ~turning
    limit = STEP_SIGMAS * 1.25 * sigma * math.sqrt(2.0 / size) + 1e-12
    rests: list[tuple[int, int]] = []
    for k in np.flatnonzero(steady).tolist():
        if rests:
            first, last = rests[-1]
            goes_on = (np.abs(means[k] - means[last]) <= limit)[1:].all()
            if k - last <= 1 + BRIDGE_BLOCKS and goes_on:
                rests[-1] = (first, k)
                continue
        rests.append((k, k))
    found = [(float(ends[a, 0] - period), float(ends[b, -1])) for a, b in rests]
    return [(start, stop) for start, stop in found if stop - start >= least_s]
