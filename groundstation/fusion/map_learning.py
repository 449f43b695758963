"""Learning the table's map from recorded flights.

The filter runs once over each recording. Its innovations are linear in the map's coefficients, and the
sensitivity of every prediction to them is carried along the trace with the filter's own gains (B. Friedland,
"Treatment of bias in recursive filtering", IEEE Trans. Autom. Control 14, 1969). The coefficients then follow
from one weighted least squares over all innovations of all recordings, which equals a filter that had carried
them as states from the start.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.fusion import error_state as es
from groundstation.fusion.table_map import Bumps, TableMap, bumps_along, coefficient_sigma
from groundstation.fusion.trace import Carried, Corrected, Trace

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class LearnedMap:
    """Coefficients of a map and what they were learned from."""

    bumps: Bumps
    coefficients: Array
    """(m,)."""
    cov: Array
    """(m, m)."""
    tilt_m_s2: Array
    """(2,) mean slope, averaged over the recordings."""
    tilt_std_m_s2: Array
    explained: float
    """How much the innovations' sum of squares (NIS) fell, as a share of it."""
    pull_sigma_m_s2: float
    path_m: Array
    """(n, 2) where the recordings flew."""


def learn(traces: list[Trace], pull_sigma_m_s2: float, width_m: float) -> LearnedMap:
    """Learn the departure from the mean slope along the paths of recorded flights.

    Args:
        traces: of filters that ran with a small waviness, so that it is left to the map.
        pull_sigma_m_s2: RMS of the departure, per axis, before anything is known.
        width_m: of the bumps; half the distance over which the pull changes its sign.

    Raises:
        ValueError: nothing was flown.
    """
    places = [step.x[es.PX : es.PY + 1] for trace in traces for c in trace.chains
              for step in c.steps if isinstance(step, Carried) and not step.is_rest]  # fmt: skip
    if len(places) < 10:
        raise ValueError("the recordings hold no flight")
    path = np.array(places)
    bumps = bumps_along(path, width_m)
    m = len(bumps.centre_m)
    information = np.eye(m) / coefficient_sigma(pull_sigma_m_s2, width_m) ** 2
    vector = np.zeros(m)
    power = 0.0
    ends = []
    for trace in traces:
        for chain in trace.chains:
            V, x, P, part = _walk(chain.x, chain.start_s, chain.steps, bumps, information, vector)
            power += part
            ends.append((V, x, P))
    cov: Array = np.asarray(np.linalg.inv(information), dtype=np.float64)
    c = cov @ vector
    slope = slice(es.SLOPE_X, es.SLOPE_Y + 1)
    tilts = np.array([x[slope] + V[slope] @ c for V, x, _ in ends])
    spread = np.array([np.diag(P)[slope] + np.diag(V[slope] @ cov @ V[slope].T) for V, _, P in ends])
    weight = 1.0 / spread
    tilt = (tilts * weight).sum(axis=0) / weight.sum(axis=0)
    fell = float(vector @ c) / power if power > 0.0 else 0.0
    return LearnedMap(
        bumps, c, cov, tilt, np.asarray(np.sqrt(1.0 / weight.sum(axis=0))), fell, pull_sigma_m_s2, path
    )


def _walk(
    start: Array,
    start_s: float,
    steps: list[Carried | Corrected],
    bumps: Bumps,
    information: Array,
    vector: Array,
) -> tuple[Array, Array, Array, float]:
    """Carry the sensitivity along one chain, adding to information and vector in place."""
    V = np.zeros((es.SIZE, len(bumps.centre_m)))
    x, t, power = start, start_s, 0.0
    P = np.zeros((es.SIZE, es.SIZE))
    slope = slice(es.SLOPE_X, es.SLOPE_Y + 1)
    for step in steps:
        if isinstance(step, Carried):
            V = step.F @ V
            if not step.is_rest:
                V[es.VX : es.PY + 1] += _driven(x, step.x, step.stop_s - t, bumps)
            x, P, t = step.x, step.P, step.stop_s
        else:
            S = step.H @ V
            if step.H[:, slope].any():  # a rest feels the slope where it stands
                S = S + step.H[:, slope] @ bumps.pull(x[None, es.PX : es.PY + 1])[0]
            information += S.T @ step.weight @ S
            vector += S.T @ step.weight @ step.z
            power += float(step.z @ step.weight @ step.z)
            V = V - step.K @ S
            x = x + step.K @ step.z
            P = P - step.K @ step.H @ P
    return V, x, P, power


def _driven(before: Array, after: Array, duration_s: float, bumps: Bumps) -> Array:
    """Return what the bumps do to vx, vy, px, py (4, m) over a step flown straight from place to place."""
    a, b = before[es.PX : es.PY + 1], after[es.PX : es.PY + 1]
    first, middle, last = bumps.pull(np.array([a, 0.5 * (a + b), b]))
    T = duration_s
    velocity = T * (first + 4.0 * middle + last) / 6.0
    position = T * T * (first + 2.0 * middle) / 6.0  # Simpson's rule on (T - t) pull(t)
    return np.concatenate([velocity, position])


def on_grid(learned: LearnedMap, step_m: float) -> TableMap:
    """Lay a learned map on a regular grid over the flown area and a margin of two widths."""
    low = learned.bumps.centre_m.min(axis=0)
    high = learned.bumps.centre_m.max(axis=0)
    x = np.arange(low[0], high[0] + step_m, step_m)
    y = np.arange(low[1], high[1] + step_m, step_m)
    places = np.array(np.meshgrid(x, y)).reshape(2, -1).T
    root = np.linalg.cholesky(learned.cov)
    pull = np.empty((len(places), 2))
    variance = np.empty(len(places))
    for k in range(0, len(places), 512):
        rows = slice(k, k + 512)
        basis = learned.bumps.pull(places[rows])
        pull[rows] = basis @ learned.coefficients + learned.tilt_m_s2
        spread = basis @ root
        variance[rows] = 0.5 * (spread**2).sum(axis=(1, 2))
    # bumps stand only near the path: away from them the prior, which the basis does not carry, is put back
    nearest = np.array([((learned.path_m - p) ** 2).sum(axis=1).min() for p in places])
    far = 1.0 - np.exp(-0.5 * nearest / learned.bumps.width_m**2)
    variance = np.maximum(variance, far * learned.pull_sigma_m_s2**2)
    shape = (len(y), len(x))
    return TableMap(
        float(x[0]), float(y[0]), step_m, pull[:, 0].reshape(shape), pull[:, 1].reshape(shape),
        np.sqrt(variance).reshape(shape),
    )  # fmt: skip
