"""Candidate poses from triangles and pairs of spots that look like triangles and pairs of stars."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.star_tracking.sky_index import SkyIndex, TriangleTable, flat_cell, triangle_key

Complex = NDArray[np.complex128]
Index = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Poses:
    """Candidate poses: star = turn * q + shift.

    Attributes:
        turn: Unit complex numbers exp(i heading), shape (h,).
        shift_m: Body origin x + iy, shape (h,).
    """

    turn: Complex
    shift_m: Complex

    def __len__(self) -> int:
        return len(self.turn)


@dataclass(frozen=True, slots=True, eq=False)
class SpotTriangles:
    """Triangles of spots: pivot, far, near; shapes (t,)."""

    pivot: Index
    far: Index
    near: Index


def spot_triangles(q_body_m: Complex, ranks: tuple[tuple[int, int], ...]) -> SpotTriangles:
    """Make a triangle of every spot with two of its neighbours, for each pair of ranks."""
    n = len(q_body_m)
    off = q_body_m[:, None] - q_body_m[None, :]
    neighbour = np.argsort(off.real**2 + off.imag**2, axis=1, kind="stable")[:, 1:]
    usable = [(near, far) for near, far in ranks if far < n - 1]
    pivot = np.tile(np.arange(n), len(usable))
    near = np.concatenate([neighbour[:, a] for a, _ in usable]) if usable else np.zeros(0, np.int64)
    far = np.concatenate([neighbour[:, b] for _, b in usable]) if usable else np.zeros(0, np.int64)
    return SpotTriangles(pivot, far, near)


def triangle_poses(index: SkyIndex, q_body_m: Complex, spots: SpotTriangles) -> Poses:
    """Look up every spot triangle among the catalogue's and give the poses that they imply."""
    q_pivot, q_far, q_near = q_body_m[spots.pivot], q_body_m[spots.far], q_body_m[spots.near]
    key = triangle_key(q_far - q_pivot, q_near - q_pivot)
    query, entry = _matching(index.triangles, key, index.tolerance_m)
    s_pivot, s_far, s_near = index.position_m[index.triangles.star[entry].T]
    q_pivot, q_far, q_near = q_pivot[query], q_far[query], q_near[query]
    s_mean, q_mean = (s_pivot + s_far + s_near) / 3.0, (q_pivot + q_far + q_near) / 3.0
    product = (s_far - s_mean) * np.conj(q_far - q_mean) + (s_near - s_mean) * np.conj(q_near - q_mean)
    product += (s_pivot - s_mean) * np.conj(q_pivot - q_mean)
    turn: Complex = np.asarray(product / np.maximum(np.abs(product), 1e-300), dtype=np.complex128)
    return Poses(turn, s_mean - turn * q_mean)


def pair_poses(index: SkyIndex, q_body_m: Complex, first: int, second: int) -> Poses:
    """Give the poses that lay one pair of spots on every pair of stars of the same distance."""
    arm = q_body_m[second] - q_body_m[first]
    length, slack = abs(arm), index.tolerance_m
    low = int(np.searchsorted(index.pair_length_m, length - slack))
    high = int(np.searchsorted(index.pair_length_m, length + slack))
    pair = index.pairs[low:high]
    a, b = index.position_m[pair[:, 0]], index.position_m[pair[:, 1]]
    turn = (b - a) / np.maximum(np.abs(b - a), 1e-300) * (np.conj(arm) / max(length, 1e-300))
    turn = np.concatenate((turn, -turn))
    middle = 0.5 * (a + b)
    return Poses(turn, np.concatenate((middle, middle)) - turn * (0.5 * (q_body_m[first] + q_body_m[second])))


def _matching(table: TriangleTable, key: NDArray[np.float64], tolerance_m: float) -> tuple[Index, Index]:
    """Give (query, entry) of all keys that agree within the tolerance."""
    count = key.shape[1]
    # The cell is at least twice the tolerance: along each axis a query touches at most two cells.
    offset = np.array([-tolerance_m, tolerance_m])
    arm = key[0] + offset[:, None]
    along = key[1] + offset[:, None]
    cell, cells = table.cell_m, table.cells
    corners = np.empty((2, 3, 2, 2, count))
    corners[:, 0] = arm[None, :, None]
    corners[:, 1] = along[None, None, :]
    corners[0, 2] = key[2] - tolerance_m
    corners[1, 2] = key[2] + tolerance_m
    flat = flat_cell(corners.transpose(1, 0, 2, 3, 4), cell, cells)
    start, stop = table.starts[flat[0]], table.starts[flat[1] + 1]
    # Both corners may lie in one cell: take it once.
    stop[1][flat[0, 1] == flat[0, 0]] = 0
    stop[:, 1][flat[0, :, 1] == flat[0, :, 0]] = 0
    start, size = start.ravel(), np.maximum(stop - start, 0).ravel()
    size[np.tile(key[0] > table.reach_m + tolerance_m, 4)] = 0
    total = int(size.sum())
    if total == 0:
        none = np.zeros(0, np.int64)
        return none, none
    begin = np.cumsum(size) - size
    entry = np.arange(total) + np.repeat(start - begin, size)
    query = np.repeat(np.tile(np.arange(count), 4), size)
    close = (np.abs(table.key_m[entry] - key.T[query]) < tolerance_m).all(axis=1)
    return query[close], entry[close]
