"""Gyro scale and null from turns against star headings."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.outcome import CalibrationRefusedError
from groundstation.fusion.stamp_screen import stretches_of

Array = NDArray[np.float64]

LEAST_TURN_RAD = 2.0 * math.pi
LEAST_FIXES = 8
TRIM_SIGMAS = 5.0
ROUNDS = 20
HOLE_S = 0.5
"""What the gyro turned in a longer hole is not known: the heading begins anew."""
LEAST_SHARE = 0.4
"""Fewer of the headings that follow the gyro are no witness."""
LARGEST_SCALE = 0.1
LARGEST_SIGMA = 0.02
LARGEST_RESIDUAL_RAD = 0.1
"""A scale beyond is none of a gyro, a sigma or residual beyond none of a calibration."""
STILL_SHARE = 0.1
"""Headings that turn by less than this share of the gyro's turn stand still."""


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
        CalibrationRefusedError: fewer than eight fixes, less than one turn, or headings that do not follow.
    """
    stretch = _stretch_of(fix_s, end_s)
    inside = (stretch >= 0) & np.isfinite(heading_rad)
    t, stars, stretch = fix_s[inside], heading_rad[inside], stretch[inside]
    if len(t) < LEAST_FIXES:
        raise CalibrationRefusedError(f"at least {LEAST_FIXES} fixes are needed, found {len(t)}")
    path = np.interp(t, end_s, np.cumsum((rate_rad_s - null_rad_s) * span_s))
    turned = max(float(np.ptp(path[stretch == k])) for k in np.unique(stretch))
    if turned < LEAST_TURN_RAD:
        raise CalibrationRefusedError(f"a full turn is needed, found {math.degrees(turned):.0f} deg")
    fit = _fit(t, path, stars, stretch)
    if not fit.is_credible:
        raise CalibrationRefusedError(_cause(t, path, stars, stretch, fit))
    return GyroScale(
        fit.scale, fit.scale_sigma, null_rad_s + fit.null_rad_s, fit.null_sigma_rad_s, turned,
        fit.residual_rms_rad, int(fit.used.sum()), int((~fit.used).sum()), t, fit.left_rad, fit.used,
    )  # fmt: skip


def _stretch_of(fix_s: Array, end_s: Array) -> NDArray[np.intp]:
    """Return for each fix the stretch of packets that it lies in, -1 where it lies in none."""
    out = np.full(len(fix_s), -1, dtype=np.intp)
    for k, rows in enumerate(stretches_of(end_s, HOLE_S)):
        out[(fix_s > end_s[rows[0]]) & (fix_s <= end_s[rows[-1]])] = k
    return out


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    scale: float
    scale_sigma: float
    null_rad_s: float
    null_sigma_rad_s: float
    left_rad: Array
    used: NDArray[np.bool_]

    @property
    def residual_rms_rad(self) -> float:
        return float(np.sqrt(np.mean(self.left_rad[self.used] ** 2)))

    @property
    def is_credible(self) -> bool:
        return (
            self.used.mean() >= LEAST_SHARE
            and self.used.sum() >= LEAST_FIXES
            and abs(self.scale) <= LARGEST_SCALE
            and self.scale_sigma <= LARGEST_SIGMA
            and self.residual_rms_rad <= LARGEST_RESIDUAL_RAD
        )


def _fit(t_s: Array, path_rad: Array, stars_rad: Array, stretch: NDArray[np.intp]) -> _Fit:
    """Fit scale and null, and an angle for each stretch; see ``gyro_scale``."""
    kinds = np.unique(stretch)
    off = np.empty_like(stars_rad)
    for k in kinds:
        off[stretch == k] = _unwrapped((stars_rad - path_rad)[stretch == k])
    A = np.column_stack([-path_rad, -(t_s - t_s[0]), stretch[:, None] == kinds])
    middle = np.array([np.median(off[stretch == k]) for k in stretch])
    used = np.abs(off - middle) < math.pi / 2
    for _ in range(ROUNDS):
        found, *_ = np.linalg.lstsq(A[used], off[used], rcond=None)
        left = off - A @ found
        sigma = 1.4826 * float(np.median(np.abs(left[used])))
        keep = np.abs(left) < TRIM_SIGMAS * sigma + 1e-12
        if (keep == used).all():
            break
        used = keep
    freedom = max(1, int(used.sum()) - A.shape[1])
    variance = float((left[used] ** 2).sum()) / freedom
    covariance = np.linalg.pinv(A[used].T @ A[used]) * variance
    sigmas = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return _Fit(float(found[0]), float(sigmas[0]), float(found[1]), float(sigmas[1]), left, used)


def _cause(t_s: Array, path_rad: Array, stars_rad: Array, stretch: NDArray[np.intp], fit: _Fit) -> str:
    """Return why the headings do not follow the gyro, the likely cause where one is found."""
    turned = np.abs(np.angle(np.exp(1j * np.diff(stars_rad)))).sum()
    if turned < STILL_SHARE * np.abs(np.diff(path_rad)).sum():
        return (
            f"the headings turn by {math.degrees(turned):.3g} deg in all, the gyro by "
            f"{math.degrees(np.abs(np.diff(path_rad)).sum()):.0f} deg: frozen fixes?"
        )
    guesses = (
        (path_rad, -stars_rad, "the headings run against the gyro: the sign of one of them is wrong"),
        (path_rad, np.radians(stars_rad), "the headings seem to be degrees, radians are expected"),
        (np.radians(path_rad), stars_rad, "the gyro's rate seems to be in deg/s, rad/s is expected"),
    )
    for path, stars, words in guesses:
        if _fit(t_s, path, stars, stretch).is_credible:
            return words
    return (
        f"the headings do not follow the gyro: the best scale is {fit.scale:.3g} ± {fit.scale_sigma:.2g}, it "
        f"fits {int(fit.used.sum())} of {len(t_s)} of them to {math.degrees(fit.residual_rms_rad):.2g} deg"
    )


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
