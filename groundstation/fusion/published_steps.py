"""The published formulas for the motion from an IMU block: zeros, axes, gates, integration and its sums.

As published: the means of a rest are the zeros (nothing trimmed) and are subtracted; accelerations go to the
table's axes; a sample whose table-frame accelerations or rate are beyond the limits is not used and nothing
is integrated by it; of the others, d after the last used one,

    v_k = v_(k-1) + a_k d        x_k = x_(k-1) + v_k d + (a_k / 2) d^2

with the new velocity in the position's step, so that a sample moves the position by (3/2) a d^2. Of constant
acceleration it would be (1/2) a d^2; over a run with even steps the printed position is ahead by d (v - v_0).

Not published, so assumed: the angle of a sample is that at its end; d after a sample that was not used counts
from the last used one; the limits hold for absolute values, and one value beyond its limit is enough (the
text joins them by "and"; `PublishedMotion.gate_needs_both` takes it at its word).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Pair = tuple[float, float]

MAX_ACC_M_S2 = 0.5
"""Published: of each acceleration in the table's axes, zeros removed."""
MAX_RATE_RAD_S = math.radians(50.0)
"""Published."""


class Moving(NamedTuple):
    """The published state, table frame: heading is counter-clockwise from table x to body x."""

    heading_rad: float
    vx_m_s: float
    vy_m_s: float
    x_m: float
    y_m: float


def zeros_of_rest(rate_rad_s: Array, ax_m_s2: Array, ay_m_s2: Array) -> tuple[float, float, float]:
    """Return what is subtracted from rate and accelerations: their means over a rest, shapes (n,)."""
    return float(np.mean(rate_rad_s)), float(np.mean(ax_m_s2)), float(np.mean(ay_m_s2))


def median_zeros_of_rest(rate_rad_s: Array, ax_m_s2: Array, ay_m_s2: Array) -> tuple[float, float, float]:
    """Return the medians over a rest instead, deaf to wild samples: an addition."""
    return float(np.median(rate_rad_s)), float(np.median(ax_m_s2)), float(np.median(ay_m_s2))


def in_table_axes(ax_m_s2: float, ay_m_s2: float, phi_rad: float) -> Pair:
    """Rotate accelerations of the body's axes as printed; the angle is minus the heading."""
    c, s = math.cos(phi_rad), math.sin(phi_rad)
    return ax_m_s2 * c + ay_m_s2 * s, ay_m_s2 * c - ax_m_s2 * s


def is_anomalous(table_m_s2: Pair, rate_rad_s: float, *, needs_both: bool = False) -> bool:
    """Tell a sample that is not used.

    Args:
        table_m_s2: Accelerations in the table's axes, zeros removed.
        rate_rad_s: Its zero removed.
        needs_both: Accelerations *and* rate must be beyond their limits.
    """
    far = not (abs(table_m_s2[0]) <= MAX_ACC_M_S2 and abs(table_m_s2[1]) <= MAX_ACC_M_S2)
    fast = not abs(rate_rad_s) <= MAX_RATE_RAD_S
    return (far and fast) if needs_both else (far or fast)


def stepped(
    state: Moving, rate_rad_s: float, force_m_s2: Pair, step_s: float, *, needs_both: bool = False
) -> Moving | None:
    """Integrate one sample as printed; None where the sample is not used.

    Args:
        state: After the last used sample.
        rate_rad_s: Its zero removed.
        force_m_s2: Body axes, zeros removed.
        step_s: Since the last used sample.
        needs_both: Of `is_anomalous`.
    """
    heading = state.heading_rad + rate_rad_s * step_s
    gx, gy = in_table_axes(*force_m_s2, -heading)
    if is_anomalous((gx, gy), rate_rad_s, needs_both=needs_both):
        return None
    vx, vy = state.vx_m_s + gx * step_s, state.vy_m_s + gy * step_s
    return Moving(
        heading,
        vx,
        vy,
        state.x_m + vx * step_s + 0.5 * gx * step_s**2,
        state.y_m + vy * step_s + 0.5 * gy * step_s**2,
    )


def stepped_exactly(state: Moving, rate_rad_s: float, force_m_s2: Pair, step_s: float) -> Moving:
    """Integrate one sample as constant acceleration along the angle of its middle: an addition of ours."""
    gx, gy = in_table_axes(*force_m_s2, -(state.heading_rad + 0.5 * rate_rad_s * step_s))
    return Moving(
        state.heading_rad + rate_rad_s * step_s,
        state.vx_m_s + gx * step_s,
        state.vy_m_s + gy * step_s,
        state.x_m + (state.vx_m_s + 0.5 * gx * step_s) * step_s,
        state.y_m + (state.vy_m_s + 0.5 * gy * step_s) * step_s,
    )


def travel_sums(acceleration_m_s2: Array, step_s: Array) -> Array:
    """Return S_k, the way that accelerations add until each sample, m.

    As printed, S_k = sum over j < k of a_j d_j (d_(j+1) + ... + d_k) + (3/2) sum over j <= k of a_j d_j^2.

    Args:
        acceleration_m_s2: Of each sample, shape (..., n).
        step_s: d of each sample, shape (n,).
    """
    gained = acceleration_m_s2 * step_s
    before = np.cumsum(gained, axis=-1) - gained
    return np.cumsum(before * step_s + 1.5 * gained * step_s, axis=-1)
