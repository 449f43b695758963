"""A flight as linear equations for the table: whitened innovations, one column per unknown.

The accelerometers are tracked as a point p with velocity v:

    v' = R (I - M)(f - b - k dT) + slope + pull(p)        p' = v        b' = white noise
    fix = p - R r + v tau

With heading and place known from a smoother all of this is linear in what is not known: M scale and axes of
the accelerometers, b bias, k its temperature slope, slope, amplitudes of the pull, r lever arm, tau delay of
the stamps. A Kalman filter over (v, p, walk of b) runs on the readings and on every unknown's column alike;
its innovations are then independent, and least squares on them is the exact generalised least squares
(P. de Jong, "The diffuse Kalman filter", Annals of Statistics 19, 1991).
A landed vehicle obeys the same equation, felt force and slope cancel; that it stands still is a measurement.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from calibration.table.flight_log import FlightLog

Array = NDArray[np.float64]

BIAS = slice(0, 2)
WARMTH = slice(2, 4)
MATRIX = slice(4, 8)
REST = slice(8, 10)
"""Extra pull while landed, table frame: pads that stand do not average the surface as pads that float."""
LEVER = slice(10, 12)
DELAY = slice(12, 13)
NUISANCES = 13
"""Unknowns that belong to one flight; then come the slope (2) and the columns of the field."""
_DRIVING = 10  # of the nuisances, those that act through the motion

BLOCK_S = 0.15
"""Stretch over which the pull is taken at one place: 15 mm at 0.1 m/s."""
LONGEST_HOLE_S = 0.5
"""After a longer hole the motion starts anew."""
STILL_EVERY_S = 1.0
STILL_SIGMA_M_S = 1e-4
START_SIGMA_M_S, START_SIGMA_M = 0.3, 3.0
NEIGHBOURS = 25


class Field(Protocol):
    """Anything that pulls in proportion to unknown amplitudes."""

    @property
    def size(self) -> int:
        """Number of columns m."""

    def columns(self, position_m: Array) -> Array:
        """Return the pull (n, 2, m) per amplitude, m/s^2, at positions (n, 2)."""


@dataclass(frozen=True, slots=True, eq=False)
class Innovation:
    """One measurement against the chain's prediction, not whitened."""

    t_s: float
    is_fix: bool
    since_fix_s: float
    """Time since the last fix before this one."""
    value: Array
    """(2,) with all unknowns zero; m or m/s."""
    columns: Array
    """(2, NUISANCES + 2 + m): value = columns @ unknowns + noise."""
    covariance: Array
    """(2, 2) of the noise."""


def innovations(
    log: FlightLog, field: Field, bias_walk_m_s2_rts: float, used: NDArray[np.bool_] | None = None
) -> Iterator[Innovation]:
    """Walk along a flight.

    Args:
        log: the flight.
        field: what pulls beside the constant slope.
        bias_walk_m_s2_rts: of the accelerometers, per square root of a second.
        used: (k,) which fixes are looked at; all by default.
    """
    size = NUISANCES + 2 + field.size
    drive, hole_variance = _driving(log), _hole_variance(log)
    density = log.acc_density_m_s2_rthz**2
    start_s, fixes = log.end_s - log.span_s, _events(log, used)
    arm = np.array(log.imu_body_m)
    S, P, now, last_fix = np.zeros((6, 1 + size)), np.eye(6), None, -np.inf
    for t, fix in fixes:
        if t <= start_s[0] or t > log.end_s[-1]:
            continue
        if now is not None and t > now:
            first = int(np.searchsorted(log.end_s, now + 1e-9, side="right"))
            last = int(np.searchsorted(log.end_s, t - 1e-9, side="left"))
            rows = slice(first, last + 1)
            if (log.span_s[rows] * log.is_hole[rows]).sum() > LONGEST_HOLE_S:
                now = None
        if now is None:
            if fix < 0:
                continue
            S, P = _begin(size), np.diag([START_SIGMA_M_S**2] * 2 + [START_SIGMA_M**2] * 2 + [0.0] * 2)
            S[2:4, 0] = log.fix_position_m[fix]
        elif t > now:
            span = np.minimum(log.end_s[rows], t) - np.maximum(start_s[rows], now)
            S, P = _carry(S, P, log, field, drive[rows], rows, span, t)
            T = t - now
            _add_noise(P, density, bias_walk_m_s2_rts**2, T, hole_variance[rows] * span, t - log.end_s[rows])
        now = t
        H = np.zeros((2, 6))
        if fix >= 0:
            H[:, 2:4] = np.eye(2)
            measured, covariance = _fix_columns(log, fix, arm, size), log.fix_covariance_m2[fix]
        else:
            H[:, 0:2] = np.eye(2)
            measured, covariance = np.zeros((2, 1 + size)), np.eye(2) * STILL_SIGMA_M_S**2
        E = measured - H @ S
        C = H @ P @ H.T + covariance
        yield Innovation(t, fix >= 0, t - last_fix, E[:, 0], -E[:, 1:], C)
        K = np.linalg.solve(C, H @ P).T
        S = S + K @ E
        L = np.eye(6) - K @ H
        P = L @ P @ L.T + K @ covariance @ K.T
        if fix >= 0:
            last_fix = t


def _begin(size: int) -> Array:
    return np.zeros((6, 1 + size))


def _events(log: FlightLog, used: NDArray[np.bool_] | None) -> list[tuple[float, int]]:
    """Return times with the number of the fix, or -1 where the vehicle is known to stand still."""
    keep = np.ones(len(log.fix_s), dtype=np.bool_) if used is None else used
    events = [(float(log.fix_s[i]), int(i)) for i in np.flatnonzero(keep)]
    for start_s, stop_s in log.rests_s:
        count = int((min(stop_s, log.end_s[-1]) - start_s) / STILL_EVERY_S)
        events += [(start_s + STILL_EVERY_S * (i + 0.5), -1) for i in range(count)]
    return sorted(events)


def _driving(log: FlightLog) -> Array:
    """Return (n, 2, 1 + driving nuisances): table-frame acceleration in each packet, and per unknown."""
    c, s = np.cos(log.heading_rad), np.sin(log.heading_rad)
    R = np.array([[c, -s], [s, c]]).transpose(2, 0, 1)
    f = log.force_body_m_s2
    centred = f - np.median(f, axis=0)  # the matrix acts on what is felt beyond the bias
    out = np.zeros((len(c), 2, 1 + _DRIVING))
    out[:, :, 0] = (R @ f[:, :, None])[:, :, 0]
    out[:, :, 1:3] = -R
    out[:, :, 3:5] = -R * log.warmth_k[:, None, None]
    for k in range(4):  # xx, xy, yx, yy
        out[:, :, 5 + k] = -R[:, :, k // 2] * centred[:, k % 2, None]
    resting = log.is_resting(log.end_s - 0.5 * log.span_s)
    out[resting, 0, 9] = out[resting, 1, 10] = 1.0
    return out


def _hole_variance(log: FlightLog) -> Array:
    """Return (n,) variance of the force in a hole, from its neighbourhood, times the hole's length."""
    out = np.zeros(len(log.end_s))
    for i in np.flatnonzero(log.is_hole):
        near = log.force_body_m_s2[max(0, i - NEIGHBOURS) : i + NEIGHBOURS]
        out[i] = float(near.var(axis=0).max()) * log.span_s[i]
    return out


def _carry(
    S: Array, P: Array, log: FlightLog, field: Field, drive: Array, rows: slice, span: Array, t: float
) -> tuple[Array, Array]:
    T = float(span.sum())
    until = t - np.minimum(log.end_s[rows], t) + 0.5 * span
    weights = np.array([span, span * until])
    flat = weights @ drive.reshape(len(span), -1)
    moved = flat.reshape(2, 2, 1 + _DRIVING)  # velocity and position, axis, column
    U = np.zeros_like(S)
    U[0:2, : 1 + _DRIVING], U[2:4, : 1 + _DRIVING] = moved[0], moved[1]
    k = 1 + NUISANCES
    U[0, k] = U[1, k + 1] = T
    U[2, k] = U[3, k + 1] = weights[1].sum()
    edges = np.unique(np.linspace(0, len(span), max(1, round(T / BLOCK_S)) + 1).astype(int))[:-1]
    sums = np.add.reduceat(weights, edges, axis=1)
    place = np.add.reduceat(log.position_table_m[rows] * span[:, None], edges) / sums[0][:, None]
    pulls = field.columns(place)
    U[0:4, k + 2 :] = np.tensordot(sums, pulls, axes=(1, 0)).reshape(4, -1)
    F = np.eye(6)
    F[2, 0] = F[3, 1] = T
    F[0:2, 4:6], F[2:4, 4:6] = moved[0][:, 1:3], moved[1][:, 1:3]
    return F @ S + U, F @ P @ F.T


def _add_noise(P: Array, density: float, walk: float, T: float, hole: Array, until: Array) -> None:
    """Add white force, the force nobody measured in holes, and the bias' walk, in place."""
    until = np.maximum(until, 0.0)
    vv = density * T + float(hole.sum())
    vp = density * T * T / 2.0 + float((hole * until).sum())
    pp = density * T**3 / 3.0 + float((hole * until**2).sum())
    for axis in (0, 1):
        P[axis, axis] += vv
        P[axis, axis + 2] += vp
        P[axis + 2, axis] += vp
        P[axis + 2, axis + 2] += pp
        P[axis + 4, axis + 4] += walk * T


def _fix_columns(log: FlightLog, fix: int, arm: Array, size: int) -> Array:
    """Return (2, 1 + size): the accelerometers' place by a fix, and how the unknowns change it."""
    c, s = np.cos(log.fix_heading_rad[fix]), np.sin(log.fix_heading_rad[fix])
    R = np.array([[c, -s], [s, c]])
    out = np.zeros((2, 1 + size))
    out[:, 0] = log.fix_position_m[fix] + R @ arm
    out[:, 1 + LEVER.start : 1 + LEVER.stop] = R
    out[:, 1 + DELAY.start] = -log.fix_velocity_m_s[fix]
    return out
