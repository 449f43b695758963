"""What motion does to a picture: bent streaks, and rows that look at different times.

With body rate w and body-frame velocity v a star's image on the ceiling, in body axes, moves as
``dq/dt = -i w q - v`` and bends as ``d2q/dt2 = -w^2 q + 2 i w v``. A centre is the mean over the
exposure T, so it lies ``T^2/24 d2q/dt2`` off the place at the middle. Only a = T w and b = T v enter,
and reversing both changes nothing: a single blurred picture tells its own correction, although not
which way it moved.

A rolling shutter reads row after row: the row at delay t sees the pose ``t`` later, and
``star = turn exp(i w t) q + v_table t + position`` brings all rows back to the middle one.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.star_tracking.fixes import BodyMotion
from groundstation.star_tracking.tracker_settings import (
    MAX_MISFIT_RATIO,
    MIN_STREAK_PX,
    MIN_STREAK_SHARE,
    MIN_STREAKS,
    SMEAR_ROUNDS,
)
from oracles.robust import middle_value

Complex = NDArray[np.complex128]
Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Smear:
    """Motion during one exposure: turn angle and path, body axes; the common sign may be wrong."""

    turn_rad: float
    path_body_m: complex


def smear_from_motion(motion: BodyMotion, exposure_s: float, turn: complex) -> Smear:
    """Give the smear of a known motion; ``turn`` is exp(i heading)."""
    velocity = complex(motion.vx_table_m_s, motion.vy_table_m_s) * np.conj(turn)
    return Smear(motion.rate_rad_s * exposure_s, complex(velocity * exposure_s))


def smear_from_streaks(q_body_m: Complex, streak_px: Array, jacobian_m_px: Array) -> Smear | None:
    """Estimate the smear from the streaks of one picture; None where there are too few.

    Each streak is ``+-(-i a q - b)``. Signs and motion are found in turn, starting from a pure shift
    and from a pure rotation; the better end wins. Lights that do not follow are left out.
    """
    chosen = np.hypot(streak_px[:, 0], streak_px[:, 1]) > MIN_STREAK_PX
    if int(chosen.sum()) < max(MIN_STREAKS, MIN_STREAK_SHARE * len(chosen)):
        return None
    q = q_body_m[chosen]
    metric = np.einsum("nij,nj->ni", jacobian_m_px[chosen], streak_px[chosen])
    streak = metric[:, 0] + 1j * metric[:, 1]
    starts = [np.full(len(q), streak[0]), -1j * (q - q.mean()), -1j * q]
    ends = [_alternate(q, streak, start) for start in starts]
    smear, misfit = min(ends, key=lambda end: end[1])
    return smear if misfit < MAX_MISFIT_RATIO * middle_value(np.abs(streak)) else None


def unbend(q_body_m: Complex, smear: Smear) -> Complex:
    """Bring mean places over an exposure to the places at its middle."""
    a, b = smear.turn_rad, smear.path_body_m
    return q_body_m + (a * a * q_body_m - 2j * a * b) / 24.0


def row_delays_s(v_px: Array, rows: int, readout_s: float) -> Array:
    """Give when each spot's row was exposed, relative to the middle row."""
    return (v_px / (rows - 1) - 0.5) * readout_s


def to_middle_row(q_body_m: Complex, delay_s: Array, motion: BodyMotion, turn: complex) -> Complex:
    """Bring spots of a rolling shutter to where the middle row would have seen them."""
    velocity = complex(motion.vx_table_m_s, motion.vy_table_m_s) * np.conj(turn)
    turned = q_body_m * np.exp(1j * motion.rate_rad_s * delay_s)
    return np.asarray(turned + velocity * delay_s, dtype=np.complex128)


def _alternate(q: Complex, streak: Complex, model: Complex) -> tuple[Smear, float]:
    """Fit signs and motion in turn; give the smear and the median misfit."""
    a, b = 0.0, 0j
    weight = np.ones(len(q))
    misfit = np.abs(streak)
    for _ in range(SMEAR_ROUNDS):
        signed = np.where((streak * np.conj(model)).real < 0.0, -streak, streak)
        total = weight.sum()
        q_mean, s_mean = (weight @ q) / total, (weight @ signed) / total
        arm, rest = q - q_mean, signed - s_mean
        # s = -i a q - b: a by the rotation about the mean, then b.
        a = float((weight * (rest * np.conj(-1j * arm)).real).sum() / (weight @ np.abs(arm) ** 2))
        b = complex(-1j * a * q_mean - s_mean)
        model = -1j * a * q - b
        misfit = np.minimum(np.abs(streak - model), np.abs(streak + model))
        weight = 1.0 / (1.0 + (misfit / max(middle_value(misfit), 1e-9)) ** 2)
    return Smear(a, b), middle_value(misfit)
