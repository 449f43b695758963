"""The nearest star, looked up in the raster."""

import numpy as np
from numpy.typing import NDArray

from groundstation.star_tracking.sky_index import SkyIndex


def nearest(sky: SkyIndex, point_m: NDArray[np.complex128]) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Give the nearest star and its distance for points of any shape; distance inf if none is near."""
    raster = sky.raster
    rows, columns = raster.star.shape
    column = ((point_m.real - raster.x0_m) * (1.0 / raster.cell_m)).astype(np.int32)
    row = ((point_m.imag - raster.y0_m) * (1.0 / raster.cell_m)).astype(np.int32)
    np.clip(column, 0, columns - 1, out=column)
    np.clip(row, 0, rows - 1, out=row)
    star = raster.star.ravel()[row * columns + column]
    return star, np.abs(point_m - sky.padded_m[star])
