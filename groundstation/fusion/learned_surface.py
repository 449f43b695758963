"""The table's waves where the vehicle has been: slopes at a few places, joined by one smooth height.

Height over the table is taken as a Gaussian process with the covariance exp(-d^2 / 2 l^2). What pulls a
gliding vehicle is its gradient, whose covariance between places (dx, dy) = d apart is

    covariance(g_i, g_j) = sigma^2 (delta_ij - d_i d_j / l^2) exp(-d^2 / 2 l^2)        i, j = x, y

(Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, section 9.4). Being a gradient it has
no curl: what pulls forward on one side of a wave pulls back on the other, and around a lap nothing is won.

The filter keeps the slopes at nodes it has passed as further states behind its own; between them the slope is
their regression. So a vehicle that hovers, or comes back, knows the place, and cost follows the way flown.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.fusion import error_state as es
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.trace import Looked

Array = NDArray[np.float64]

UNKNOWN_SHARE = 0.4
"""Of the variance that the nodes leave open at a place: beyond, the place becomes a node.

Nodes twice as dense estimate no better."""
MAX_NODES = 32
"""On a larger table the nodes farthest away are given up: 87 states bound the cost of a fix."""
UNIT = np.eye(2)
NUGGET = 1e-4
"""Of the variance, on the diagonal, against neighbours that are nearly one."""


@dataclass(frozen=True, slots=True, eq=False)
class LearnedSurface:
    """Where the nodes are; their slopes are states of the filter, two (x, y) per node from `es.SIZE` on."""

    nodes_m: Array
    """(m, 2) table frame."""
    length_m: float
    inverse: Array
    """(2m, 2m) of the nodes' covariance in units of sigma^2."""

    @classmethod
    def through(cls, nodes_m: Array, length_m: float) -> LearnedSurface:
        """Return the surface with these nodes (m, 2)."""
        K = covariance(nodes_m, nodes_m, length_m)
        K[np.diag_indices_from(K)] += NUGGET
        return cls(nodes_m, length_m, np.asarray(np.linalg.inv(K), dtype=np.float64))

    @classmethod
    def untouched(cls, noise: NoiseModel) -> LearnedSurface:
        """Return the surface of a table on which nothing is known yet."""
        return cls.through(np.zeros((0, 2)), noise.waviness_length_m)

    def weights(self, place_m: Array) -> tuple[Array, Array]:
        """Return how the slope at a place (2,) follows from the nodes', and what they leave open.

        Returns:
            Regression weights (2, 2m), and the covariance (2, 2) about it in units of sigma^2.
        """
        d = (place_m - self.nodes_m) / self.length_m
        near = np.exp(-0.5 * np.einsum("ij,ij->i", d, d))
        k = ((UNIT[:, None] - d.T[:, :, None] * d) * near[:, None]).reshape(2, -1)
        w = k @ self.inverse
        return w, UNIT - w @ k.T


def covariance(p_m: Array, q_m: Array, length_m: float) -> Array:
    """Return (2a, 2b) of the slopes at places (a, 2) and (b, 2), in units of sigma^2; x, y alternate."""
    d = (p_m[:, None, :] - q_m[None, :, :]) / length_m
    x, y = d[..., 0], d[..., 1]
    near = np.exp(-0.5 * (x * x + y * y))
    out = np.empty((len(p_m), 2, len(q_m), 2))
    out[:, 0, :, 0] = (1.0 - x * x) * near
    out[:, 1, :, 1] = (1.0 - y * y) * near
    out[:, 0, :, 1] = out[:, 1, :, 0] = -x * y * near
    return out.reshape(2 * len(p_m), 2 * len(q_m))


def look(
    surface: LearnedSurface, x: Array, P: Array, place_m: Array, noise: NoiseModel
) -> tuple[LearnedSurface, Array, Array, Looked]:
    """Let the local slope be that of a place, which becomes a node if the others say too little of it.

    Args:
        surface: the nodes so far.
        x: (23 + 2m,) nominal state; may be changed.
        P: (23 + 2m, 23 + 2m) covariance; may be changed.
        place_m: (2,) table frame.
        noise: sigma of the waves.

    Returns:
        Surface, state and covariance, perhaps larger by a node, and the step for the smoother.
    """
    variance = noise.waviness_sigma_m_s2**2
    w, left = surface.weights(place_m)
    dropped, grown = None, None
    if 0.5 * (left[0, 0] + left[1, 1]) > UNKNOWN_SHARE:
        if len(surface.nodes_m) >= MAX_NODES:
            surface, x, P, dropped = _without_the_farthest(surface, x, P, place_m)
            w, left = surface.weights(place_m)
        grown = w
        x, P = _with_node(x, P, w, variance * left)
        surface = LearnedSurface.through(np.vstack([surface.nodes_m, place_m]), surface.length_m)
        w, left = np.zeros((2, len(x) - es.SIZE)), np.zeros((2, 2))
        w[0, -2] = w[1, -1] = 1.0
    cross = w @ P[es.SIZE :]
    here = slice(es.WAVE_X, es.WAVE_Y + 1)
    x[here] = w @ x[es.SIZE :]
    P[here] = cross
    P[:, here] = cross.T
    P[here, here] = cross[:, es.SIZE :] @ w.T + variance * left
    return surface, x, P, Looked(w, grown, dropped)


def _with_node(x: Array, P: Array, w: Array, left: Array) -> tuple[Array, Array]:
    n = len(x)
    cross = w @ P[es.SIZE :]
    larger = np.empty((n + 2, n + 2))
    larger[:n, :n] = P
    larger[n:, :n] = cross
    larger[:n, n:] = cross.T
    larger[n:, n:] = cross[:, es.SIZE :] @ w.T + left
    return np.concatenate([x, w @ x[es.SIZE :]]), larger


def _without_the_farthest(
    surface: LearnedSurface, x: Array, P: Array, place_m: Array
) -> tuple[LearnedSurface, Array, Array, int]:
    far = int(((surface.nodes_m - place_m) ** 2).sum(axis=1).argmax())
    keep = np.delete(np.arange(len(x)), [es.SIZE + 2 * far, es.SIZE + 2 * far + 1])
    kept = LearnedSurface.through(np.delete(surface.nodes_m, far, axis=0), surface.length_m)
    return kept, x[keep], P[np.ix_(keep, keep)], far
