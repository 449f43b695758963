"""Triangles of neighbouring spots: what a rigid motion leaves alone, so that pictures can be compared.

Every spot forms triangles with pairs of its nearest neighbours. A triangle is written with its longest
side first and in the order in which its corners follow, so that equal triangles have equal lengths in
equal places; a mirrored one has not, because its turning sense is part of the key.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Complex = NDArray[np.complex128]
Index = NDArray[np.int64]

_NEIGHBOURS = 6
_MIN_SIDE_RATIO = 0.25  # of the shortest to the longest side: a needle tells no direction


@dataclass(frozen=True, slots=True, eq=False)
class Triangles:
    """Triangles of one constellation.

    Attributes:
        corner: Rows of the constellation, the longest side from the first to the second, shape (t, 3).
        key_m: Lengths of the three sides, signed by the turning sense, shape (t, 3), m.
    """

    corner: Index
    key_m: NDArray[np.float64]


def neighbour_triangles(point_m: Complex) -> Triangles:
    """Give each triangle of neighbours once.

    Args:
        point_m: Constellation, shape (n,).
    """
    n = len(point_m)
    count = min(_NEIGHBOURS, n - 1)
    if count < 2:
        return Triangles(np.zeros((0, 3), np.int64), np.zeros((0, 3)))
    plane = np.stack((point_m.real, point_m.imag), axis=1)
    near = np.asarray(cKDTree(plane).query(plane, k=count + 1)[1], dtype=np.int64)
    pairs = np.array(list(combinations(range(1, count + 1), 2)))
    corner = np.concatenate(
        [np.stack((near[:, 0], near[:, a], near[:, b]), axis=1) for a, b in pairs.tolist()]
    )
    corner = np.unique(np.sort(corner, axis=1), axis=0)
    side = np.stack(
        [np.abs(point_m[corner[:, (k + 1) % 3]] - point_m[corner[:, k]]) for k in range(3)], axis=1
    )
    corner = corner[side.min(axis=1) > _MIN_SIDE_RATIO * side.max(axis=1)]
    return _ordered(point_m, corner)


def _ordered(point_m: Complex, corner: Index) -> Triangles:
    """Turn every triangle counter-clockwise and begin at its longest side."""
    a, b, c = (point_m[corner[:, k]] for k in range(3))
    clockwise = (np.conj(b - a) * (c - a)).imag < 0.0
    corner = np.where(clockwise[:, None], corner[:, [0, 2, 1]], corner)
    side = np.stack(
        [np.abs(point_m[corner[:, (k + 1) % 3]] - point_m[corner[:, k]]) for k in range(3)], axis=1
    )
    first = side.argmax(axis=1)[:, None]
    turned = (first + np.arange(3)) % 3
    return Triangles(np.take_along_axis(corner, turned, axis=1), np.take_along_axis(side, turned, axis=1))
