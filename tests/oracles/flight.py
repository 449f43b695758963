"""A stretch of packets as a whole: nominal motion, error transition and process noise in few array products.

Everything is a weighted sum over the packets: a force in the middle of packet i changes the velocity at the
end by dt_i times itself, and the position by dt_i times the time that is left. So one product of a table of
inputs with two rows of weights gives all entries of the transition.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.fusion.error_state import (
    ACC_BIAS_X,
    ACC_BIAS_Y,
    ACC_MATRIX,
    ACC_TEMPCO_X,
    ACC_TEMPCO_Y,
    GYRO_BIAS,
    GYRO_SCALE,
    GYRO_TEMPCO,
    MOVING,
    PX,
    PY,
    SIZE,
    SLOPE_X,
    SLOPE_Y,
    THETA,
    VX,
    VY,
    WAVE_X,
    WAVE_Y,
)
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.packet_history import Segment
from groundstation.fusion.slope_grid import SlopeGrid

Array = NDArray[np.float64]

NEIGHBOURS = 25
"""Packets on either side of a hole that tell how busy the valves were; more than a control period."""


@dataclass(frozen=True, slots=True, eq=False)
class Flight:
    """Nominal motion over a segment, with what its covariance needs."""

    duration_s: float
    moved: Array
    """(5,) theta, vx, vy, px, py at the end."""
    theta_mid: Array
    """(n,) heading in the middle of each packet, used to rotate the forces."""
    turned: Array
    """(n,) heading there less the heading at the start."""
    force_body: Array
    """(2, n) specific force, corrected."""
    force_table: Array
    """(2, n) the same in the table frame, without the slope."""
    until_end_s: Array
    """(n,) from the middle of each packet to the end of the segment."""


def fly(x: Array, segment: Segment, lag_difference_s: float, table_map: SlopeGrid | None = None) -> Flight:
    """Integrate a segment from the nominal state.

    Args:
        x: (23,) nominal state at the segment's start.
        segment: packets; body frame.
        lag_difference_s: the gyro's low-pass time constant less the accelerometers'; forces are as old as
            their filter, so they are turned by the heading of that moment.
        table_map: what is known of the slope beforehand; the states hold what is not.
    """
    dt = segment.span_s
    warmth = segment.warmth_k
    w = (segment.rate_rad_s - x[GYRO_BIAS] - x[GYRO_TEMPCO] * warmth) * (1.0 - x[GYRO_SCALE])
    step = w * dt
    after = np.cumsum(step)
    turned = after - 0.5 * step
    theta = turned + (x[THETA] + lag_difference_s * w)
    ux = segment.ax_m_s2 - x[ACC_BIAS_X] - x[ACC_TEMPCO_X] * warmth
    uy = segment.ay_m_s2 - x[ACC_BIAS_Y] - x[ACC_TEMPCO_Y] * warmth
    mxx, mxy, myx, myy = x[ACC_MATRIX : ACC_MATRIX + 4]
    f = np.empty((2, len(dt)))
    f[0] = (1.0 - mxx) * ux - mxy * uy
    f[1] = (1.0 - myy) * uy - myx * ux
    c, s = np.cos(theta), np.sin(theta)
    a = np.empty_like(f)
    a[0] = c * f[0] - s * f[1]
    a[1] = s * f[0] + c * f[1]
    elapsed = np.cumsum(dt)
    duration = float(elapsed[-1]) if len(dt) else 0.0
    until_end = duration - elapsed + 0.5 * dt
    gx, gy = x[SLOPE_X] + x[WAVE_X], x[SLOPE_Y] + x[WAVE_Y]
    pulled = a
    if table_map is not None:
        # the path to look it up along needs no more than a centimetre
        began = elapsed - 0.5 * dt
        pulled = a + table_map.along(x[PX] + x[VX] * began, x[PY] + x[VY] * began)
    push = pulled * dt
    moved = np.empty(MOVING)
    moved[THETA] = x[THETA] + (after[-1] if len(dt) else 0.0)
    moved[VX] = x[VX] + push[0].sum() + gx * duration
    moved[VY] = x[VY] + push[1].sum() + gy * duration
    half = 0.5 * duration * duration
    moved[PX] = x[PX] + x[VX] * duration + push[0] @ until_end + gx * half
    moved[PY] = x[PY] + x[VY] * duration + push[1] @ until_end + gy * half
    return Flight(duration, moved, theta, turned, f, a, until_end)


def transition(segment: Segment, flight: Flight) -> Array:
    """Return the five moving rows (5, 23) of the error transition over a segment."""
    T = flight.duration_s
    dt = segment.span_s
    c, s = np.cos(flight.theta_mid), np.sin(flight.theta_mid)
    ax, ay = flight.force_table
    fx, fy = flight.force_body
    since = T - flight.until_end_s
    warm = segment.warmth_k * dt
    warm_since = np.cumsum(warm) - 0.5 * warm
    warmth = segment.warmth_k
    inputs = np.array(
        [ax, ay, since * ax, since * ay, flight.turned * ax, flight.turned * ay, c, s, c * fx, s * fx,
         c * fy, s * fy, warm_since * ax, warm_since * ay, warmth * c, warmth * s]
    )  # fmt: skip
    weights = np.array([dt, dt * flight.until_end_s])
    G = (inputs @ weights.T).T  # row 0 into the velocity, row 1 into the position

    F = np.zeros((MOVING, SIZE))
    F[:, :MOVING] = np.eye(MOVING)
    F[PX, VX] = F[PY, VY] = T
    F[THETA, GYRO_BIAS] = -T
    F[THETA, GYRO_SCALE] = -(flight.moved[THETA] - flight.theta_mid[0] + flight.turned[0]) if len(dt) else 0.0
    F[THETA, GYRO_TEMPCO] = -float(warm.sum())
    for k, (row_x, row_y) in enumerate(((VX, VY), (PX, PY))):
        g = G[k]
        F[row_x, THETA], F[row_y, THETA] = -g[1], g[0]
        F[row_x, GYRO_BIAS], F[row_y, GYRO_BIAS] = g[3], -g[2]
        F[row_x, GYRO_SCALE], F[row_y, GYRO_SCALE] = g[5], -g[4]
        F[row_x, GYRO_TEMPCO], F[row_y, GYRO_TEMPCO] = g[13], -g[12]
        F[row_x, ACC_BIAS_X], F[row_y, ACC_BIAS_X] = -g[6], -g[7]
        F[row_x, ACC_BIAS_Y], F[row_y, ACC_BIAS_Y] = g[7], -g[6]
        F[row_x, ACC_TEMPCO_X], F[row_y, ACC_TEMPCO_X] = -g[14], -g[15]
        F[row_x, ACC_TEMPCO_Y], F[row_y, ACC_TEMPCO_Y] = g[15], -g[14]
        F[row_x, ACC_MATRIX], F[row_y, ACC_MATRIX] = -g[8], -g[9]
        F[row_x, ACC_MATRIX + 1], F[row_y, ACC_MATRIX + 1] = -g[10], -g[11]
        F[row_x, ACC_MATRIX + 2], F[row_y, ACC_MATRIX + 2] = g[9], -g[8]
        F[row_x, ACC_MATRIX + 3], F[row_y, ACC_MATRIX + 3] = g[11], -g[10]
        span = T if k == 0 else 0.5 * T * T
        F[row_x, SLOPE_X] = F[row_y, SLOPE_Y] = span
        F[row_x, WAVE_X] = F[row_y, WAVE_Y] = span
    return F


def moving_noise(segment: Segment, flight: Flight, noise: NoiseModel) -> Array:
    """Return the process covariance (5, 5) that a segment adds to theta, v and p.

    White sensor noise, and for each packet that was not measured a force and a rate of the size of those in
    its neighbourhood: whatever the valves did in the hole, they did it as much as just before and after.
    """
    T = flight.duration_s
    qa = noise.acc_density_m_s2_rthz**2
    Q = np.zeros((MOVING, MOVING))
    Q[THETA, THETA] = noise.gyro_density_rad_s_rthz**2 * T
    vv, vp, pp = qa * T, qa * T * T / 2.0, qa * T**3 / 3.0
    holes = np.nonzero(segment.is_hole)[0]
    for i in holes:
        near = slice(max(0, i - NEIGHBOURS), i + NEIGHBOURS)
        span, left = float(segment.span_s[i]), float(flight.until_end_s[i])
        knocked = float(flight.force_body[:, near].var(axis=1).max()) * span**2
        vv += knocked
        vp += knocked * left
        pp += knocked * left**2
        Q[THETA, THETA] += float(segment.rate_rad_s[near].var()) * span**2
    Q[VX, VX] = Q[VY, VY] = vv
    Q[VX, PX] = Q[PX, VX] = Q[VY, PY] = Q[PY, VY] = vp
    Q[PX, PX] = Q[PY, PY] = pp
    return Q
