"""What calibration knows of the table's slope, laid on a grid for feed-forward."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.table_map import TableMap

Array = NDArray[np.float64]

RELEVELLING_SIGMA_M_S2 = 3e-4
"""How much a table's tilt may have changed since its map was made: 0.03 mrad."""


@dataclass(frozen=True, slots=True, eq=False)
class SlopeGrid:
    """Pull along the table on a regular grid; arrays are (rows, columns) over y, x.

    Between grid points it is bilinear, outside the grid it is the mean.
    """

    x0_m: float
    y0_m: float
    step_m: float
    pull_x_m_s2: Array
    pull_y_m_s2: Array
    sigma_m_s2: Array
    """Sigma of the pull, per axis."""
    mean_m_s2: tuple[float, float]

    def at(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Return the pull at one place; plain floats, it is called in the hot path."""
        rows, columns = self.pull_x_m_s2.shape
        u = (x_m - self.x0_m) / self.step_m
        v = (y_m - self.y0_m) / self.step_m
        if not (0.0 <= u <= columns - 1.0 and 0.0 <= v <= rows - 1.0):
            return self.mean_m_s2
        i, j = min(int(u), columns - 2), min(int(v), rows - 2)
        a, b = u - i, v - j
        x, y = self.pull_x_m_s2, self.pull_y_m_s2
        near, right = (1.0 - a) * (1.0 - b), a * (1.0 - b)
        above, across = (1.0 - a) * b, a * b
        return (
            near * x.item(j, i)
            + right * x.item(j, i + 1)
            + above * x.item(j + 1, i)
            + across * x.item(j + 1, i + 1),
            near * y.item(j, i)
            + right * y.item(j, i + 1)
            + above * y.item(j + 1, i)
            + across * y.item(j + 1, i + 1),
        )

    def along(self, x_m: Array, y_m: Array) -> Array:
        """Return (2, n) pulls along a path."""
        rows, columns = self.pull_x_m_s2.shape
        u, v = (x_m - self.x0_m) / self.step_m, (y_m - self.y0_m) / self.step_m
        outside = ~((u >= 0.0) & (u <= columns - 1.0) & (v >= 0.0) & (v <= rows - 1.0))
        u, v = np.where(outside, 0.0, u), np.where(outside, 0.0, v)
        i, j = np.minimum(u.astype(int), columns - 2), np.minimum(v.astype(int), rows - 2)
        a, b = u - i, v - j
        out = np.empty((2, len(u)))
        for k, field in enumerate((self.pull_x_m_s2, self.pull_y_m_s2)):
            low = (1.0 - a) * field[j, i] + a * field[j, i + 1]
            high = (1.0 - a) * field[j + 1, i] + a * field[j + 1, i + 1]
            out[k] = np.where(outside, self.mean_m_s2[k], (1.0 - b) * low + b * high)
        return out


def noise_with(noise: NoiseModel, grid: SlopeGrid) -> NoiseModel:
    """Return the model of what the map leaves unknown of the slope.

    The best-known quarter of the grid is where vehicles fly; a little more than its sigma is left to do.
    """
    left = min(1.25 * float(np.percentile(grid.sigma_m_s2, 25)), noise.waviness_sigma_m_s2)
    return replace(noise, slope_sigma_m_s2=RELEVELLING_SIGMA_M_S2, waviness_sigma_m_s2=left)


def slope_grid(found: TableMap) -> SlopeGrid:
    """Return a map as filters and controllers read it."""
    sigma = np.sqrt(0.5 * (found.sigma_x_m_s2**2 + found.sigma_y_m_s2**2))
    return SlopeGrid(
        found.x_min_m, found.y_min_m, found.step_m, found.ax_m_s2, found.ay_m_s2, sigma, found.mean_m_s2
    )
