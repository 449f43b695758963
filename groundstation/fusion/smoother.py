"""The offline smoother: every packet's state from all fixes, before and after.

The filter's trace is walked backwards (`walk_back`).
Between the ends of two steps the packets are integrated from the smoothed start; what is missing at the end
is spread as a cubic, which is the mean of an integrated random walk tied at both ends.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.fusion import error_state as es
from groundstation.fusion import measurements
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.packet_history import PacketHistory, Segment
from groundstation.fusion.slope_grid import SlopeGrid
from groundstation.fusion.trace import Trace
from groundstation.fusion.walk_back import Node, smooth_chain

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Smoothed:
    """Smoothed motion of the centre of mass, table frame; NaN before the first pose."""

    t_s: Array
    """(n,) ends of the packets since the filter's origin; holes have rows of their own."""
    state: Array
    """(n, 9) x, y, heading, vx, vy, rate, bias_omega, bias_ax, bias_ay."""
    sigma: Array
    """(n, 3) of x, y, heading."""
    nodes: list[Node]


def smooth(
    trace: Trace, history: PacketHistory, noise: NoiseModel, table_map: SlopeGrid | None = None
) -> Smoothed:
    """Smooth a finished run of the filter.

    Args:
        trace: what the filter wrote down.
        history: all packets of the run, as the filter kept them.
        noise: the filter's model.
        table_map: the filter's map.
    """
    t = np.array(history.rows[::7])
    state = np.full((len(t), 9), math.nan)
    sigma = np.full((len(t), 3), math.nan)
    all_nodes: list[Node] = []
    for number, chain in enumerate(trace.chains):
        nodes = smooth_chain(chain)
        if number == 0 and chain.is_rest:
            # standing still before the first fix was taken where it stood at that fix
            first = nodes[0]
            nodes.insert(0, Node(-math.inf, first.x, first.P, is_rest=True))
            nodes[1] = Node(first.t_s, first.x, first.P, is_rest=True)
        for before, after in itertools.pairwise(nodes):
            rows = slice(*np.searchsorted(t, [before.t_s + 1e-9, after.t_s + 1e-9]))
            if rows.stop > rows.start:
                segment = history.between(before.t_s, after.t_s)
                whole = rows.stop - rows.start  # the packet that the step's end cuts belongs to the next
                moved, moved_sigma = _between(before, after, segment, noise, table_map)
                state[rows], sigma[rows] = moved[:whole], moved_sigma[:whole]
        all_nodes += nodes
    return Smoothed(t, state, sigma, all_nodes)


def _between(
    before: Node, after: Node, segment: Segment, noise: NoiseModel, table_map: SlopeGrid | None
) -> tuple[Array, Array]:
    """Return states (n, 9) and sigmas (n, 3) at the ends of the packets of one step."""
    x = before.x
    n = len(segment.span_s)
    dt = segment.span_s
    if after.is_rest:
        rate, theta = np.zeros(n), np.full(n, after.x[es.THETA])
        v, p, a = np.zeros((2, n)), np.repeat(after.x[es.PX : es.PY + 1, None], n, axis=1), np.zeros((2, n))
        share = np.ones(n)
    else:
        warm = segment.warmth_k
        rate = (segment.rate_rad_s - x[es.GYRO_BIAS] - x[es.GYRO_TEMPCO] * warm) * (1.0 - x[es.GYRO_SCALE])
        theta = x[es.THETA] + np.cumsum(rate * dt)
        pull = x[es.SLOPE_X : es.SLOPE_Y + 1] + x[es.WAVE_X : es.WAVE_Y + 1]
        a = _forces(x, segment, rate, noise) + pull[:, None]
        if table_map is not None:
            began = np.cumsum(dt) - 0.5 * dt
            a = a + table_map.along(x[es.PX] + x[es.VX] * began, x[es.PY] + x[es.VY] * began)
        push = a * dt
        v = x[es.VX : es.VY + 1, None] + np.cumsum(push, axis=1)
        p = x[es.PX : es.PY + 1, None] + np.cumsum((v - 0.5 * push) * dt, axis=1)
        elapsed = np.cumsum(dt)
        T = float(elapsed[-1])
        share = elapsed / T
        left = after.x[: es.MOVING] - np.array([theta[-1], v[0, -1], v[1, -1], p[0, -1], p[1, -1]])
        theta = theta + left[es.THETA] * share
        dv, dp = left[es.VX : es.VY + 1, None], left[es.PX : es.PY + 1, None]
        p = p + (3 * share**2 - 2 * share**3) * dp + (share**3 - share**2) * T * dv
        v = v + 6 * (share - share**2) / T * dp + (3 * share**2 - 2 * share) * dv
    theta = theta + noise.gyro_lag_s * rate
    p = p + noise.acc_lag_s * v
    v = v + noise.acc_lag_s * a
    c, s = np.cos(theta), np.sin(theta)
    rx, ry = after.x[es.LEVER_X], after.x[es.LEVER_Y]
    lx, ly = c * rx - s * ry, s * rx + c * ry
    g = after.x[es.SLOPE_X : es.SLOPE_Y + 1] + after.x[es.WAVE_X : es.WAVE_Y + 1]
    if table_map is not None:
        g = g + np.array(table_map.at(float(after.x[es.PX]), float(after.x[es.PY])))
    warmth = segment.warmth_k
    bias = [
        after.x[es.GYRO_BIAS] + after.x[es.GYRO_TEMPCO] * warmth,
        after.x[es.ACC_BIAS_X] + after.x[es.ACC_TEMPCO_X] * warmth - (c * g[0] + s * g[1]),
        after.x[es.ACC_BIAS_Y] + after.x[es.ACC_TEMPCO_Y] * warmth - (c * g[1] - s * g[0]),
    ]
    state = np.column_stack([p[0] - lx, p[1] - ly, theta, v[0] + rate * ly, v[1] - rate * lx, rate, *bias])
    ends = [np.diag(measurements.reported(node.x, 0.0) @ node.P @ measurements.reported(node.x, 0.0).T)
            for node in (before, after)]  # fmt: skip
    variance = np.outer(1.0 - share, ends[0][:3]) + np.outer(share, ends[1][:3])
    return state, np.sqrt(np.maximum(variance, 0.0))


def _forces(x: Array, segment: Segment, rate_rad_s: Array, noise: NoiseModel) -> Array:
    """Return the specific force (2, n) of each packet, corrected, table frame.

    Forces are as old as their filter, so they are turned by the heading of that moment.
    """
    step = rate_rad_s * segment.span_s
    middle = np.cumsum(step) - 0.5 * step
    theta = middle + (x[es.THETA] + (noise.gyro_lag_s - noise.acc_lag_s) * rate_rad_s)
    ux = segment.ax_m_s2 - x[es.ACC_BIAS_X] - x[es.ACC_TEMPCO_X] * segment.warmth_k
    uy = segment.ay_m_s2 - x[es.ACC_BIAS_Y] - x[es.ACC_TEMPCO_Y] * segment.warmth_k
    mxx, mxy, myx, myy = x[es.ACC_MATRIX : es.ACC_MATRIX + 4]
    fx, fy = (1.0 - mxx) * ux - mxy * uy, (1.0 - myy) * uy - myx * ux
    c, s = np.cos(theta), np.sin(theta)
    return np.stack([c * fx - s * fy, s * fx + c * fy])
