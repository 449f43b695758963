"""The modified Bryson-Frazier recursion over one chain of the filter's trace.

Bierman, "Fixed interval smoothing with discrete measurements", Int. J. Control 18, 1973. It needs no inverse
of a covariance: many of these are singular, because a rest knows the velocity and some states are certain.
Transitions are not written out: most of their rows are those of the identity.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.fusion import error_state as es
from groundstation.fusion.trace import Carried, Chain, Corrected, Looked, Step

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Node:
    """Smoothed state at the end of one step."""

    t_s: float
    x: Array
    """(23,)."""
    P: Array
    """(23, 23)."""
    is_rest: bool
    """Whether the step that ends here was one of rest."""


def smooth_chain(chain: Chain) -> list[Node]:
    """Return the smoothed states at the start of a chain and at the end of each of its stretches."""
    size = next((len(s.K) if isinstance(s, Corrected) else s.P.shape[1]
                 for s in reversed(chain.steps) if not isinstance(s, Looked)), chain.P.shape[1])  # fmt: skip
    lam, Lam = np.zeros((size, 1)), np.zeros((size, size))
    nodes: list[Node] = []
    for step in reversed(chain.steps):
        if isinstance(step, Carried):
            nodes.append(_node(step.stop_s, step.x, step.P, lam, Lam, is_rest=step.is_rest))
        lam, Lam = _back(step, lam), _back(step, _back(step, Lam).T)
        if isinstance(step, Corrected):
            lam[: es.SIZE, 0] -= step.H.T @ (step.weight @ step.z)
            Lam[: es.SIZE, : es.SIZE] += step.H.T @ step.weight @ step.H
    nodes.append(_node(chain.start_s, chain.x, chain.P, lam, Lam, is_rest=chain.is_rest))
    nodes.reverse()
    return nodes


def _back(step: Step, after: Array) -> Array:
    """Return F^T times `after` (N, k), F being the step's transition."""
    if isinstance(step, Corrected):
        before = after.copy()
        before[: es.SIZE] -= step.H.T @ (step.K.T @ after)
        return before
    if isinstance(step, Carried):
        before = after.copy()
        before[: es.MOVING] = 0.0
        before[: es.SIZE] += step.rows.T @ after[: es.MOVING]
        return before
    before = after.copy()
    wave = slice(es.WAVE_X, es.WAVE_Y + 1)
    before[wave] = 0.0
    before[es.SIZE :] += step.weights.T @ after[wave]
    if step.grown is not None:
        before, added = before[:-2], before[-2:]
        before[es.SIZE :] += step.grown.T @ added
    if step.dropped is not None:
        before = np.insert(before, [es.SIZE + 2 * step.dropped] * 2, 0.0, axis=0)
    return before


def _node(t_s: float, x: Array, P: Array, lam: Array, Lam: Array, *, is_rest: bool) -> Node:
    smoothed = P[:, : es.SIZE] - P @ Lam @ P.T
    return Node(t_s, x - (P @ lam)[:, 0], 0.5 * (smoothed + smoothed.T), is_rest)
