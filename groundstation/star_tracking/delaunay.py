"""Delaunay triangles of points in a plane, by their interior angles."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

Array = NDArray[np.float64]


def triangles_of(points: Array) -> tuple[NDArray[np.int64], Array]:
    """Triangulate points and sort the vertices of each triangle by their angle.

    Args:
        points: Shape (n, 2).

    Returns:
        Triangles (t, 3) as rows of the points, the vertex of the smallest interior angle first, and
        (smallest, largest) interior angle of each (t, 2), rad.

    Raises:
        scipy.spatial.QhullError: There are fewer than three points, or all lie on one line.
    """
    triangles = Delaunay(points).simplices.astype(np.int64)
    corner = points[triangles]
    one = np.roll(corner, -1, axis=1) - corner
    two = np.roll(corner, 1, axis=1) - corner
    cross = one[..., 0] * two[..., 1] - one[..., 1] * two[..., 0]
    angle = np.arctan2(np.abs(cross), (one * two).sum(axis=2))
    order = np.argsort(angle, axis=1)
    angle = np.take_along_axis(angle, order, axis=1)
    return np.take_along_axis(triangles, order, axis=1), angle[:, [0, 2]]
