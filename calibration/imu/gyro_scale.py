"""Gyro scale and null from turns against star headings."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.outcome import CalibrationRefusedError

Array = NDArray[np.float64]

LEAST_TURN_RAD = 2.0 * math.pi
TRIM_SIGMAS = 5.0
ROUNDS = 20


@dataclass(frozen=True, slots=True, eq=False)
class GyroScale:
    """True rate = (reading - null) (1 - scale)."""

    scale: float
    scale_sigma: float
    null_rad_s: float
    null_sigma_rad_s: float
    turned_rad: float
    """Between the most distant headings of the gyro's path."""
    residual_rms_rad: float
    used: int
    refused: int
    fix_s: Array
    residual_rad: Array
    """(m,) of all fixes, refused ones too."""
    is_used: NDArray[np.bool_]


def gyro_scale(
    end_s: Array, span_s: Array, rate_rad_s: Array, fix_s: Array, heading_rad: Array, null_rad_s: float
) -> GyroScale:
    """Fit heading_k = heading_0 + (1 - scale)(Theta_k - null t_k) to the stars, wrong fixes trimmed.

    Args:
        end_s: (n,) ends of the packets, ascending.
        span_s: (n,) the time each stands for.
        rate_rad_s: (n,) readings.
        fix_s: (m,) exposures.
        heading_rad: (m,) star headings, wrapped or not.
        null_rad_s: rough null, to unwrap with.

    Raises:
        CalibrationRefusedError: fewer than eight fixes, or less than one turn.
    """
    inside = (fix_s > end_s[0]) & (fix_s <= end_s[-1]) & np.isfinite(heading_rad)
    t, stars = fix_s[inside], heading_rad[inside]
    if len(t) < 8:
        raise CalibrationRefusedError(f"at least 8 fixes are needed, found {len(t)}")
    path = np.interp(t, end_s, np.cumsum((rate_rad_s - null_rad_s) * span_s))
    elapsed = t - t[0]
    turned = float(np.ptp(path))
    if turned < LEAST_TURN_RAD:
        raise CalibrationRefusedError(f"a full turn is needed, found {math.degrees(turned):.0f} deg")
    off = _unwrapped(stars - path)
    A = np.column_stack([np.ones_like(elapsed), -path, -elapsed])
    used = np.abs(off - np.median(off)) < math.pi / 2
    for _ in range(ROUNDS):
        found, *_ = np.linalg.lstsq(A[used], off[used], rcond=None)
        left = off - A @ found
        sigma = 1.4826 * float(np.median(np.abs(left[used])))
        keep = np.abs(left) < TRIM_SIGMAS * sigma + 1e-12
        if (keep == used).all():
            break
        used = keep
    freedom = max(1, int(used.sum()) - 3)
    variance = float((left[used] ** 2).sum()) / freedom
    covariance = np.linalg.inv(A[used].T @ A[used]) * variance
    null_sigma = math.sqrt(covariance[2, 2])
    return GyroScale(
        float(found[1]), math.sqrt(covariance[1, 1]), null_rad_s + float(found[2]), null_sigma, turned,
        float(np.sqrt(np.mean(left[used] ** 2))), int(used.sum()), int((~used).sum()), t, left, used,
    )  # fmt: skip


def _unwrapped(off_rad: Array) -> Array:
    """Unwrap slowly drifting differences against the median of their last few; a wrong one does no harm."""
    out = np.empty_like(off_rad)
    for k, value in enumerate(off_rad):
        near = float(np.median(out[max(0, k - 5) : k])) if k else _circular_median(off_rad[:5])
        out[k] = near + math.remainder(float(value) - near, math.tau)
    return out


def _circular_median(angles_rad: Array) -> float:
    """Return the one of a few angles that is nearest to the others."""
    apart = np.abs(np.angle(np.exp(1j * (angles_rad[:, None] - angles_rad[None, :]))))
    return float(angles_rad[int(np.argmin(apart.sum(axis=1)))])
