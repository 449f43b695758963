"""A stretch of flight prepared for the offset fit: heading integrated, wrong fixes left out."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from groundstation.fusion.offset_fit import OffsetFit, fit_offsets

Array = NDArray[np.float64]

MAX_SPEED_M_S = 0.2
"""Nothing on a table flies faster."""
MAX_RATE_RAD_S = math.radians(60.0)
MAX_FORCE_M_S2 = 0.5
SIGMAS = 6.0
TRIM_SIGMAS = 4.0


def fit_stretch(
    imu: Array,
    stars: Array,
    start_s: float,
    end_s: float,
    null_rad_s: float,
    lever_m: tuple[float, float],
    sigma: tuple[float, float],
) -> tuple[OffsetFit, int]:
    """Fit (mu, nu) over a stretch of a recording.

    Args:
        imu: (n, >= 4) stamp s, rate, ax, ay; ascending.
        stars: (m, 5) exposure s, arrival s, x, y, heading.
        start_s: start of the stretch.
        end_s: its end.
        null_rad_s: the gyro's null.
        lever_m: the accelerometers from the body's origin, body frame.
        sigma: of a fix, m and rad.

    Returns:
        The fit, and how many fixes of the stretch were left out as wrong.

    Raises:
        ValueError: too little data in the stretch.
    """
    packets = imu[(imu[:, 0] >= start_s) & (imu[:, 0] <= end_s)]
    if len(packets) < 10:
        raise ValueError("no packets in the stretch")
    t = packets[:, 0]
    readings = packets[:, 1:4].copy()
    bad = ~(
        (np.abs(readings[:, 0]) < MAX_RATE_RAD_S) & (np.abs(readings[:, 1:]) < MAX_FORCE_M_S2).all(axis=1)
    )
    for column in readings.T:
        column[bad] = np.interp(t[bad], t[~bad], column[~bad])
    span = np.diff(t, prepend=t[0] - float(np.median(np.diff(t))))
    step = (readings[:, 0] - null_rad_s) * span
    turned = np.cumsum(step)
    fixes = stars[(stars[:, 0] > t[0]) & (stars[:, 0] <= t[-1]) & np.isfinite(stars).all(axis=1)]
    fixes = fixes[np.argsort(fixes[:, 0], kind="stable")]
    found = len(fixes)
    path = np.interp(fixes[:, 0], t, turned)
    fixes, path = _plausible(fixes, path, sigma)
    if len(fixes) < 4:
        raise ValueError(f"the offsets need at least 4 agreeing fixes, found {len(fixes)}")
    # one heading constant from all stars of the stretch; the gyro carries it
    constant = math.atan2(np.sin(fixes[:, 4] - path).mean(), np.cos(fixes[:, 4] - path).mean())
    heading = constant + turned - 0.5 * step
    at_fix = constant + path
    c, s = np.cos(at_fix), np.sin(at_fix)
    rx, ry = lever_m
    points = np.array([fixes[:, 2] + c * rx - s * ry, fixes[:, 3] + s * rx + c * ry])
    force = readings[:, 1:].T
    fit = fit_offsets(t, span, heading, force, fixes[:, 0], points, sigma[0])
    keep = np.linalg.norm(fit.residual_m, axis=0) < TRIM_SIGMAS * max(fit.residual_rms_m, 2.0 * sigma[0])
    if 4 <= keep.sum() < len(keep):
        kept = np.concatenate([[True], keep])
        fit = fit_offsets(t, span, heading, force, fixes[kept, 0], points[:, kept], sigma[0])
    return fit, found - fit.fixes


def _plausible(fixes: Array, path_rad: Array, sigma: tuple[float, float]) -> tuple[Array, Array]:
    """Leave out fixes from which no vehicle could have come to most of the others."""
    t, xy = fixes[:, 0], fixes[:, 2:4]
    apart = np.linalg.norm(xy[:, None] - xy[None], axis=2)
    reach = MAX_SPEED_M_S * np.abs(t[:, None] - t[None]) + SIGMAS * 1.5 * sigma[0]
    off = fixes[:, 4] - path_rad
    turned = np.abs(np.angle(np.exp(1j * (off[:, None] - off[None]))))
    slack = SIGMAS * 1.5 * sigma[1] + math.radians(1.0)
    agrees = (apart <= reach) & (turned <= slack)
    # neighbours in time are the strictest judges of a position
    near = np.abs(t[:, None] - t[None]) < 4.0
    good = (agrees & near).sum(axis=1) > 0.5 * near.sum(axis=1)
    return fixes[good], path_rad[good]
