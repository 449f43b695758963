"""From a fitted surface to the map that filters and controllers read."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

from calibration.table.surface_fit import SurfaceFit
from groundstation.fusion.table_map import G_M_S2, MapProvenance, TableMap

Array = NDArray[np.float64]

STEPS_PER_WAVE = 16
"""Grid points per shortest wave: bilinear interpolation then errs by 2 % of it at most."""


def map_of(fit: SurfaceFit, provenance: MapProvenance) -> TableMap:
    """Lay a fit on a grid over the table."""
    x_min, x_max, y_min, y_max = fit.basis.bounds_m
    longest = max(x_max - x_min, y_max - y_min)
    step = longest / max(2, math.ceil(longest * STEPS_PER_WAVE / fit.basis.shortest_wave_m))
    x: Array = x_min + step * np.arange(math.ceil((x_max - x_min) / step - 1e-6) + 1.0)
    y: Array = y_min + step * np.arange(math.ceil((y_max - y_min) / step - 1e-6) + 1.0)
    places = np.stack(np.meshgrid(x, y), axis=-1)
    shape = places.shape[:2]
    acceleration, potential = np.empty((*shape, 2)), np.empty(shape)
    for row, line in enumerate(places):
        acceleration[row] = fit.acceleration_m_s2(line)
        potential[row] = fit.basis.potentials(line) @ fit.shared[2:]
    mean, covariance = fit.mean_over(places.reshape(-1, 2)[:: max(1, places.size // 8000)])
    off = places - places.reshape(-1, 2).mean(axis=0)
    # what the mean over the table holds of the waves belongs to the plane, not to the height about it
    plane = off @ (mean - fit.shared[:2])
    height = -(potential - plane) / G_M_S2
    height -= height.mean()
    sigma = _sigma_on(fit, x, y)
    far = math.hypot(fit.waviness_m_s2, math.sqrt(float(covariance.diagonal().max())))
    return TableMap(
        float(x[0]), float(y[0]), step, acceleration[..., 0], acceleration[..., 1],
        sigma[..., 0], sigma[..., 1], height, (float(mean[0]), float(mean[1])), covariance, far, provenance,
    )  # fmt: skip


def _sigma_on(fit: SurfaceFit, x: Array, y: Array) -> Array:
    """Return the sigma (rows, columns, 2), found at every other point, where it is smooth enough."""
    coarse_x, coarse_y = np.unique([*x[::2], x[-1]]), np.unique([*y[::2], y[-1]])
    places = np.stack(np.meshgrid(coarse_x, coarse_y), axis=-1)
    sigma = fit.sigma_m_s2(places.reshape(-1, 2)).reshape(places.shape)
    between = RegularGridInterpolator((coarse_y, coarse_x), sigma)
    wanted = np.stack(np.meshgrid(x, y), axis=-1)[..., ::-1]
    return np.asarray(between(wanted))
