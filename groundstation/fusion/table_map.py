"""The table's slope as a field: a mean tilt, and a potential on a grid of smooth bumps.

What pulls a gliding vehicle along the table (tilt, waves, a slow leak of air) is taken as the gradient of a
potential: pull(p) = tilt + sum_j c_j (p - q_j) / l^2 exp(-|p - q_j|^2 / 2 l^2). A pull with curl, as a hose
may exert, is not represented; it shows in the residuals.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from groundstation.fusion.noise import NoiseModel

Array = NDArray[np.float64]

G_M_S2 = 9.80665


@dataclass(frozen=True, slots=True, eq=False)
class Bumps:
    """The basis of a map."""

    centre_m: Array
    """(m, 2) in the table frame."""
    width_m: float

    def pull(self, position_m: Array) -> Array:
        """Return (n, 2, m): the pull of each bump with coefficient one at positions (n, 2)."""
        off = position_m[:, None, :] - self.centre_m[None]
        weight = np.exp(-0.5 * (off**2).sum(axis=2) / self.width_m**2) / self.width_m**2
        return np.asarray((off * weight[:, :, None]).transpose(0, 2, 1))


def bumps_along(path_m: Array, width_m: float) -> Bumps:
    """Return a grid of bumps, one width apart, wherever the path (n, 2) comes within two widths."""
    low, high = path_m.min(axis=0) - 2.0 * width_m, path_m.max(axis=0) + 2.0 * width_m
    x = np.arange(low[0], high[0] + width_m, width_m)
    y = np.arange(low[1], high[1] + width_m, width_m)
    grid = np.array(np.meshgrid(x, y)).reshape(2, -1).T
    coarse = path_m[:: max(1, len(path_m) // 3000)]
    near = np.array([float(((coarse - q) ** 2).sum(axis=1).min()) < (2.0 * width_m) ** 2 for q in grid])
    return Bumps(grid[near], width_m)


def coefficient_sigma(pull_sigma_m_s2: float, width_m: float) -> float:
    """Return the coefficients' prior sigma that gives the pull this RMS on a grid one width apart."""
    return pull_sigma_m_s2 * width_m * math.sqrt(2.0 / math.pi)


@dataclass(frozen=True, slots=True, eq=False)
class TableMap:
    """Pull on a regular grid, for feed-forward; outside the grid the edge's value holds.

    Arrays are (rows, columns) over y, x.
    """

    x0_m: float
    y0_m: float
    step_m: float
    pull_x_m_s2: Array
    pull_y_m_s2: Array
    std_m_s2: Array
    """Sigma of the pull, per axis; where nothing was flown it is that of the waviness."""

    def at(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Return the pull at one place, linear between grid points."""
        rows, columns = self.pull_x_m_s2.shape
        u = min(max((x_m - self.x0_m) / self.step_m, 0.0), columns - 1.0)
        v = min(max((y_m - self.y0_m) / self.step_m, 0.0), rows - 1.0)
        i, j = min(int(u), columns - 2), min(int(v), rows - 2)
        a, b = u - i, v - j
        out = []
        for field in (self.pull_x_m_s2, self.pull_y_m_s2):
            low = (1.0 - a) * field[j, i] + a * field[j, i + 1]
            high = (1.0 - a) * field[j + 1, i] + a * field[j + 1, i + 1]
            out.append(float((1.0 - b) * low + b * high))
        return out[0], out[1]

    def along(self, x_m: Array, y_m: Array) -> Array:
        """Return (2, n) pulls along a path."""
        rows, columns = self.pull_x_m_s2.shape
        u = np.clip((x_m - self.x0_m) / self.step_m, 0.0, columns - 1.0)
        v = np.clip((y_m - self.y0_m) / self.step_m, 0.0, rows - 1.0)
        i = np.minimum(u.astype(int), columns - 2)
        j = np.minimum(v.astype(int), rows - 2)
        a, b = u - i, v - j
        out = np.empty((2, len(u)))
        for k, field in enumerate((self.pull_x_m_s2, self.pull_y_m_s2)):
            low = (1.0 - a) * field[j, i] + a * field[j, i + 1]
            high = (1.0 - a) * field[j + 1, i] + a * field[j + 1, i + 1]
            out[k] = (1.0 - b) * low + b * high
        return out


RELEVELLING_SIGMA_M_S2 = 3e-4
"""How much a table's tilt may have changed since its map was made: 0.03 mrad."""


def noise_with(noise: NoiseModel, table_map: TableMap) -> NoiseModel:
    """Return the model of what the map leaves unknown of the slope."""
    left = 2.0 * float(np.percentile(table_map.std_m_s2, 25))
    return replace(
        noise,
        slope_sigma_m_s2=RELEVELLING_SIGMA_M_S2,
        waviness_sigma_m_s2=min(left, noise.waviness_sigma_m_s2),
    )


def mean_tilt_rad(table_map: TableMap) -> tuple[float, float]:
    """Return the tilt (pull over g) averaged over the places that were flown, weighted by their certainty."""
    weight = 1.0 / table_map.std_m_s2**2
    return (
        float((table_map.pull_x_m_s2 * weight).sum() / weight.sum()) / G_M_S2,
        float((table_map.pull_y_m_s2 * weight).sum() / weight.sum()) / G_M_S2,
    )


def levelling_m(tilt_rad: tuple[float, float], legs_m: dict[str, tuple[float, float]]) -> dict[str, float]:
    """Return by how much to raise each leg to take the tilt away; the leg that needs least stays.

    A vehicle is pulled downhill, so the table is higher where the pull comes from: along +x by -tilt_x per m.

    Args:
        tilt_rad: pull over g, along x and y.
        legs_m: where the legs stand, table frame.
    """
    height = {name: -(tilt_rad[0] * x + tilt_rad[1] * y) for name, (x, y) in legs_m.items()}
    highest = max(height.values())
    return {name: highest - h for name, h in height.items()}
