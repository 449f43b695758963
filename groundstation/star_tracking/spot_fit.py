"""Sub-pixel centres of spots from their pixels."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SpotPixels:
    """Pixels of all spots in one row, spot after spot.

    Attributes:
        u_px: Column of every pixel, shape (p,).
        v_px: Row of every pixel, shape (p,).
        light_dn: Light above the background, shape (p,).
        variance_dn2: Variance of a pixel without the star's own shot noise, shape (p,).
        is_saturated: Only a lower bound, shape (p,).
        size: Pixels of every spot, shape (n,).
        gain_dn_per_electron: Shot-noise variance per DN of light.
    """

    u_px: Vector
    v_px: Vector
    light_dn: Vector
    variance_dn2: Vector
    is_saturated: NDArray[np.bool_]
    size: NDArray[np.int64]
    gain_dn_per_electron: float

    @cached_property
    def starts(self) -> NDArray[np.int64]:
        """First pixel of every spot, shape (n,)."""
        return np.concatenate(([0], np.cumsum(self.size)[:-1]))

    @cached_property
    def owner(self) -> NDArray[np.int64]:
        """Spot of every pixel, shape (p,)."""
        return np.repeat(np.arange(len(self.size)), self.size)

    def keep(self, spots: NDArray[np.bool_]) -> "SpotPixels":
        """Give the pixels of some spots only."""
        pixel = np.repeat(spots, self.size)
        return SpotPixels(
            self.u_px[pixel],
            self.v_px[pixel],
            self.light_dn[pixel],
            self.variance_dn2[pixel],
            self.is_saturated[pixel],
            self.size[spots],
            self.gain_dn_per_electron,
        )


@dataclass(frozen=True, slots=True, eq=False)
class FittedSpots:
    """Centres, light and shape of spots; arrays of one entry per spot as in ``Spots``."""

    u_px: Vector
    v_px: Vector
    flux_dn: Vector
    cov_px2: Vector
    elongation: Vector
    streak_px: Vector


def fit_spots(pixels: SpotPixels) -> FittedSpots:
    """Give intensity-weighted centres with their covariance."""
    starts, owner = pixels.starts, pixels.owner
    light = np.maximum(pixels.light_dn, 0.0)
    flux = np.maximum(np.add.reduceat(light, starts), 1e-9)
    u = np.add.reduceat(light * pixels.u_px, starts) / flux
    v = np.add.reduceat(light * pixels.v_px, starts) / flux
    du, dv = pixels.u_px - u[owner], pixels.v_px - v[owner]
    variance = pixels.variance_dn2 + pixels.gain_dn_per_electron * light
    moments = np.add.reduceat(light * np.stack((du * du, du * dv, dv * dv)), starts, axis=1) / flux
    cov = np.add.reduceat(variance * np.stack((du * du, du * dv, dv * dv)), starts, axis=1) / flux**2
    half = 0.5 * (moments[0] + moments[2])
    spread = np.hypot(0.5 * (moments[0] - moments[2]), moments[1])
    long, short = half + spread, np.maximum(half - spread, 1e-3)
    elongation = np.sqrt(long / short)
    return FittedSpots(u, v, flux, cov.T.copy(), elongation, np.zeros((len(u), 2)))
