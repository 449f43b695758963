"""Least squares for the accelerometers' constant offsets (mu, nu) over a stretch of flight.

After the published one (`published_offset_fit`, to the letter), with additions of ours: constant acceleration
over a packet, the start velocity corrected by the travel of its interval, and a covariance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class OffsetFit:
    """Constant offsets to be taken from the accelerometers, body axes, and how well they fit."""

    mu_m_s2: float
    nu_m_s2: float
    covariance: Array
    """(2, 2) m^2/s^4: the fixes' sigma through the fit and through the start's finite difference, widened by
    the residual where that is larger than the fixes explain."""
    residual_rms_m: float
    fixes: int
    residual_m: Array
    """(2, m - 1) of the fixes after the first."""


def fit_offsets(
    end_s: Array,
    span_s: Array,
    heading_rad: Array,
    force_body: Array,
    fix_s: Array,
    fix_xy_m: Array,
    fix_sigma_m: float,
) -> OffsetFit:
    """Fit (mu, nu) such that the doubly integrated acceleration passes through the fixes.

    Start position and velocity are the first fix and the finite difference of the first two; the acceleration
    in the table frame is R(heading) (force - (mu, nu)), so position is linear in the two unknowns.

    Args:
        end_s: (n,) ends of the packets, ascending, in s.
        span_s: (n,) their spans.
        heading_rad: (n,) headings in the middle of the packets.
        force_body: (2, n) accelerometer readings, body axes, m/s^2.
        fix_s: (m,) exposures, ascending, within the packets, in s.
        fix_xy_m: (2, m) positions of the IMU point, table frame.
        fix_sigma_m: of a position, per axis.

    Raises:
        ValueError: fewer than four fixes, or a stretch over which the offsets cannot be told.
    """
    if len(fix_s) < 4:
        msg = f"the offsets need at least 4 fixes in the stretch, found {len(fix_s)}"
        raise ValueError(msg)
    c, s = np.cos(heading_rad), np.sin(heading_rad)
    columns = np.array([c * force_body[0] - s * force_body[1], s * force_body[0] + c * force_body[1], c, s])
    # velocity and position at the packets' ends from zero at the first of them, for each column
    velocity = np.cumsum(columns * span_s, axis=1)
    before = velocity - columns * span_s
    position = np.cumsum(before * span_s + 0.5 * columns * span_s**2, axis=1)
    at_fix = np.array([np.interp(fix_s, end_s, row) for row in position])
    start_velocity = np.array([np.interp(fix_s[0], end_s, row) for row in velocity])
    elapsed = fix_s - fix_s[0]
    travel = at_fix - at_fix[:, :1] - start_velocity[:, None] * elapsed
    first_velocity = (fix_xy_m[:, 1] - fix_xy_m[:, 0]) / elapsed[1]
    # over the first interval the mean velocity is the finite difference; take the travel's part off it
    first_velocity = first_velocity - travel[:2, 1] / elapsed[1]
    y = (fix_xy_m - fix_xy_m[:, :1] - first_velocity[:, None] * elapsed - travel[:2])[:, 1:]
    tc, ts = (travel[2:] - np.outer(travel[2:, 1] / elapsed[1], elapsed))[:, 1:]
    A = np.concatenate([np.column_stack([-tc, ts]), np.column_stack([-ts, -tc])])
    b = np.concatenate([y[0], y[1]])
    normal = A.T @ A
    if np.linalg.cond(normal) > 1e10:
        msg = "the stretch is too short to tell the offsets"
        raise ValueError(msg)
    found = np.linalg.solve(normal, A.T @ b)
    left = b - A @ found
    # y_k = e_k - e_0 - (e_1 - e_0) t_k / t_1: the start's two fixes sit in every residual
    m = len(fix_s)
    noise = np.zeros((m - 1, m))
    noise[:, 1:] = np.eye(m - 1)
    noise[:, 0] = elapsed[1:] / elapsed[1] - 1.0
    noise[:, 1] -= elapsed[1:] / elapsed[1]
    gain = np.linalg.solve(normal, A.T) @ np.kron(np.eye(2), noise)
    expected = np.trace(noise @ noise.T) / (m - 1) * fix_sigma_m**2
    widening = max(1.0, float(np.mean(left**2)) / expected)
    covariance = gain @ gain.T * fix_sigma_m**2 * widening
    rms = float(np.sqrt(np.mean(left**2)))
    return OffsetFit(float(found[0]), float(found[1]), covariance, rms, len(fix_s), left.reshape(2, -1))
