"""Look-ups into the catalogue that do not grow with it.

* ``raster``: over the ceiling; each cell names its nearest star, so that testing a pose is
  one table look-up per spot.
* ``triangles``: every star as pivot with pairs (near, far) of its neighbours. A triangle's key is
  three lengths in the frame of its longer arm: arm length, and the near star along and across it.
  The key is signed, so a mirror image does not match. Keys are binned into a dense grid of cells.
* ``pairs``: pairs of stars sorted by their distance, for skies with few stars left.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from groundstation.star_tracking.star_catalogue import StarCatalogue

_RASTER_CELL_M = 0.02
_RASTER_REACH_M = 0.12
_NEIGHBOURS = 16
_MAX_KEY_CELLS = 6_000_000

Index = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class TriangleTable:
    """Triangles of stars, sorted by key cell.

    Attributes:
        star: Catalogue rows: pivot, far, near; shape (t, 3).
        key_m: Arm length, along, across; shape (t, 3), m.
        starts: First triangle of every cell, flat, one more entry than cells.
        cell_m: Edge of a cell.
        reach_m: Longest arm.
        cells: Cells along arm, along, across.
    """

    star: NDArray[np.int32]
    key_m: NDArray[np.float64]
    starts: NDArray[np.int32]
    cell_m: float
    reach_m: float
    cells: tuple[int, int, int]


@dataclass(frozen=True, slots=True, eq=False)
class StarRaster:
    """The nearest star of every cell of the ceiling; cells of the rim name none.

    Attributes:
        star: Catalogue row, or the number of stars for none; shape (rows, columns).
        x0_m: Lower edge of the first column.
        y0_m: Lower edge of the first row.
        cell_m: Edge of a cell.
    """

    star: NDArray[np.int32]
    x0_m: float
    y0_m: float
    cell_m: float


class SkyIndex:
    """Tables over one catalogue: built once, read only.

    Args:
        catalogue: The stars.
        tolerance_m: How far a triangle's lengths may be off.
        reach_m: Longest distance that one picture shows.
    """

    def __init__(self, catalogue: StarCatalogue, tolerance_m: float, reach_m: float) -> None:
        self.padded_m = np.append(
            catalogue.x_m + 1j * catalogue.y_m, np.inf
        )  # the last is the star that is none
        self.position_m = self.padded_m[:-1]
        self.variance_m2 = catalogue.sigma_m**2
        self.tolerance_m = tolerance_m
        points = np.stack((catalogue.x_m, catalogue.y_m), axis=1)
        tree = cKDTree(points)
        self.raster = _build_raster(points)
        span = np.ptp(points, axis=0)
        self.area_m2 = float(max(span[0], 0.1) * max(span[1], 0.1))
        self.density_m2 = len(points) / self.area_m2
        self.triangles = _build_triangles(points, tree, tolerance_m, reach_m, self.density_m2)
        pairs = tree.query_pairs(0.7 * reach_m, output_type="ndarray")
        length = np.abs(self.position_m[pairs[:, 0]] - self.position_m[pairs[:, 1]])
        order = np.argsort(length, kind="stable")
        self.pairs = pairs[order].astype(np.int32)
        self.pair_length_m = length[order]


def _build_raster(points: NDArray[np.float64]) -> StarRaster:
    cells = int(np.ceil(_RASTER_REACH_M / _RASTER_CELL_M))
    low = points.min(axis=0) - (cells + 2) * _RASTER_CELL_M
    columns, rows = np.ceil(np.ptp(points, axis=0) / _RASTER_CELL_M).astype(int) + 2 * cells + 4
    step = np.arange(-cells, cells + 1)
    du, dv = (grid.ravel() for grid in np.meshgrid(step, step))
    home = ((points - low) / _RASTER_CELL_M).astype(np.int64)
    column, row = home[:, :1] + du, home[:, 1:] + dv
    centre_x = low[0] + (column + 0.5) * _RASTER_CELL_M
    centre_y = low[1] + (row + 0.5) * _RASTER_CELL_M
    distance = np.hypot(centre_x - points[:, :1], centre_y - points[:, 1:])
    star = np.broadcast_to(np.arange(len(points), dtype=np.int32)[:, None], distance.shape)
    order = np.argsort(-distance.ravel(), kind="stable")  # the nearest is written last
    raster = np.full(rows * columns, len(points), dtype=np.int32)
    raster[(row * columns + column).ravel()[order]] = star.ravel()[order]
    return StarRaster(raster.reshape(rows, columns), float(low[0]), float(low[1]), _RASTER_CELL_M)


def _build_triangles(
    points: NDArray[np.float64], tree: cKDTree, tolerance_m: float, reach_m: float, density_m2: float
) -> TriangleTable:
    arm_m = min(float(np.sqrt(_NEIGHBOURS / (np.pi * density_m2))), reach_m)
    count = min(_NEIGHBOURS + 1, len(points))
    found = tree.query(points, k=count)
    distance, neighbour = np.asarray(found[0]), np.asarray(found[1])
    first, second = np.triu_indices(count - 1, k=1)  # neighbours come sorted: first is the nearer one
    pivot = np.repeat(np.arange(len(points)), len(first))
    near, far = neighbour[:, 1 + first].ravel(), neighbour[:, 1 + second].ravel()
    short = distance[:, 1 + second].ravel() < arm_m
    pivot, near, far = pivot[short], near[short], far[short]
    complex_points = points[:, 0] + 1j * points[:, 1]
    key = triangle_key(
        complex_points[far] - complex_points[pivot], complex_points[near] - complex_points[pivot]
    )
    # About as many cells as triangles: the table of cells stays small enough for the processor's cache.
    fewest = min(max(len(pivot), 1), _MAX_KEY_CELLS)
    cell = max(2.0 * tolerance_m, (4.0 * (arm_m + 4 * tolerance_m) ** 3 / fewest) ** (1.0 / 3.0))
    cells = (int(arm_m / cell) + 2, 2 * int(arm_m / cell) + 4, 2 * int(arm_m / cell) + 4)
    flat = flat_cell(key, cell, cells)
    order = np.argsort(flat, kind="stable")
    total = cells[0] * cells[1] * cells[2]
    starts = np.searchsorted(flat[order], np.arange(total + 1)).astype(np.int32)
    stars = np.stack((pivot, far, near), axis=1)[order].astype(np.int32)
    return TriangleTable(stars, np.ascontiguousarray(key.T[order]), starts, cell, arm_m, cells)


def triangle_key(far_m: NDArray[np.complex128], near_m: NDArray[np.complex128]) -> NDArray[np.float64]:
    """Give (arm, along, across), shape (3, t), of triangles given as vectors from their pivot."""
    arm = np.abs(far_m)
    turned = near_m * np.conj(far_m) / np.maximum(arm, 1e-300)
    return np.stack((arm, turned.real, turned.imag))


def flat_cell(key_m: NDArray[np.float64], cell_m: float, cells: tuple[int, int, int]) -> Index:
    """Give the flat cell number of keys (3, t); outside keys are moved to the rim."""
    half = cells[1] // 2
    arm = np.clip(np.floor(key_m[0] / cell_m), 0, cells[0] - 1).astype(np.int64)
    along = np.clip(np.floor(key_m[1] / cell_m) + half, 0, cells[1] - 1).astype(np.int64)
    across = np.clip(np.floor(key_m[2] / cell_m) + half, 0, cells[2] - 1).astype(np.int64)
    flat: Index = (arm * cells[1] + along) * cells[2] + across
    return flat
