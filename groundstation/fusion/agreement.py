"""Whether fixes say the same: two at the start, and several that a lost filter refused."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.fusion.estimator import Fix
from groundstation.fusion.noise import NoiseModel

Array = NDArray[np.float64]

MAX_SPEED_M_S = 0.2
"""Nothing on a table flies faster; bounds what two first fixes may differ by."""
SIGMAS = 6.0
NULL_SIGMAS = 3.0
CURVED_SHARE = 0.02
"""A lost filter's innovations run along a line, but for this share of their size."""


class Between(NamedTuple):
    """What may have happened between two exposures."""

    flown_s: float
    """Zero at rest."""
    turned_rad: float
    """By the gyro."""
    null_sigma_rad_s: float
    """How well the gyro's null is known."""


def fixes_agree(first: Fix, second: Fix, between: Between) -> bool:
    """Return whether one vehicle may have been seen at both poses."""
    slack = SIGMAS * np.sqrt(np.diag(first.covariance) + np.diag(second.covariance))
    slack[:2] += MAX_SPEED_M_S * between.flown_s
    slack[2] += NULL_SIGMAS * between.null_sigma_rad_s * between.flown_s
    off = [
        second.x_m - first.x_m,
        second.y_m - first.y_m,
        math.remainder(second.heading_rad - first.heading_rad - between.turned_rad, math.tau),
    ]
    return bool((np.abs(off) < slack).all())


def innovations_agree(refused: list[tuple[float, Array]], noise: NoiseModel) -> bool:
    """Return whether refused innovations (s, (3,) x, y, heading) lie on a line, as a lost filter's do."""
    t = np.array([r[0] - refused[0][0] for r in refused])
    z = np.array([r[1] for r in refused])
    z[:, 2] = np.unwrap(z[:, 2])
    line = np.polynomial.polynomial.polyfit(t, z, 1)
    left = np.abs(z - line[0] - np.outer(t, line[1]))
    sigma = np.array([noise.star_sigma_xy_m, noise.star_sigma_xy_m, noise.star_sigma_heading_rad])
    return bool((left < SIGMAS * sigma + CURVED_SHARE * np.abs(z).max(axis=0)).all())
