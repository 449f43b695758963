"""The surface as a sum of smooth modes: a height field whose downhill slope pulls the vehicle.

The accelerometers feel everything but gravity, so what is missing from them is the gradient of one height:
a field without curl. The height is a Gaussian process of Matern covariance, written in the
eigenfunctions of the Laplacian on a rectangle around the table, where the prior is diagonal (A. Solin,
S. Sarkka, "Hilbert space methods for reduced-rank Gaussian process regression", Statistics and Computing 30,
2020; for potentials: A. Solin et al., "Modeling and interpolation of the ambient magnetic field by Gaussian
processes", IEEE Trans. Robotics 34, 2018).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MARGIN_M = 0.5
"""The rectangle of the modes is larger than the table by this, because they vanish at its border."""

SMOOTHNESS = 3.5
"""Of the Matern covariance. A smoother one believes too much of what it infers beside the lanes."""


MOST_MODES = 6_000
"""Before those of shorter waves are left out; the fit takes the cube of their number."""


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceBasis:
    """Modes up to a shortest wavelength.

    Amplitudes are of the potential, whose gradient is the pull: -g times the height; m^2/s^2.
    """

    bounds_m: tuple[float, float, float, float]
    """x_min, x_max, y_min, y_max of the table."""
    shortest_wave_m: float
    kx_rad_m: Array
    """(modes of x,) wave numbers along x."""
    ky_rad_m: Array
    index: NDArray[np.intp]
    """(m, 2) which wave number along x and y a mode has."""

    @classmethod
    def over(cls, bounds_m: tuple[float, float, float, float], shortest_wave_m: float = 0.4) -> SurfaceBasis:
        """Return the modes of a table.

        Raises:
            ValueError: the bounds are not in order, the wavelength is not a positive number, or the modes are
                too many.
        """
        x_min, x_max, y_min, y_max = bounds_m
        if not (x_min < x_max and y_min < y_max):
            raise ValueError(
                f"bounds must be x_min, x_max, y_min, y_max with min below max, found {bounds_m}"
            )
        if not (math.isfinite(shortest_wave_m) and shortest_wave_m > 0.0):
            raise ValueError(f"the shortest wavelength must be above zero, found {shortest_wave_m!r}")
        largest = 2.0 * math.pi / shortest_wave_m
        width, depth = x_max - x_min + 2.0 * MARGIN_M, y_max - y_min + 2.0 * MARGIN_M
        kx: Array = math.pi / width * np.arange(1, max(1, int(largest * width / math.pi)) + 1.0)
        ky: Array = math.pi / depth * np.arange(1, max(1, int(largest * depth / math.pi)) + 1.0)
        if kx.size * ky.size > MOST_MODES:
            raise ValueError(
                f"a table of {x_max - x_min:.3g} m x {y_max - y_min:.3g} m with waves down to "
                f"{shortest_wave_m:g} m takes more numbers than can be fitted: smaller bounds or a longer "
                "shortest wave are expected"
            )
        square = kx[:, None] ** 2 + ky[None, :] ** 2
        return cls(bounds_m, shortest_wave_m, kx, ky, np.argwhere(square <= largest**2))

    @property
    def size(self) -> int:
        """Number of modes."""
        return len(self.index)

    def columns(self, position_m: Array) -> Array:
        """Return the pull (n, 2, m) of each mode of amplitude one at positions (n, 2)."""
        x = position_m[:, :1] - (self.bounds_m[0] - MARGIN_M)
        y = position_m[:, 1:] - (self.bounds_m[2] - MARGIN_M)
        i, j = self.index[:, 0], self.index[:, 1]
        sx, cx = np.sin(x * self.kx_rad_m)[:, i], (np.cos(x * self.kx_rad_m) * self.kx_rad_m)[:, i]
        sy, cy = np.sin(y * self.ky_rad_m)[:, j], (np.cos(y * self.ky_rad_m) * self.ky_rad_m)[:, j]
        return np.asarray(np.stack([cx * sy, sx * cy], axis=1))

    def potentials(self, position_m: Array) -> Array:
        """Return the potential (n, m) of each mode of amplitude one."""
        x = position_m[:, :1] - (self.bounds_m[0] - MARGIN_M)
        y = position_m[:, 1:] - (self.bounds_m[2] - MARGIN_M)
        i, j = self.index[:, 0], self.index[:, 1]
        return np.asarray(np.sin(x * self.kx_rad_m)[:, i] * np.sin(y * self.ky_rad_m)[:, j])

    def prior_variance(self, sigma_m_s2: float, length_m: float) -> Array:
        """Return the amplitudes' prior variances (m,).

        Args:
            sigma_m_s2: standard deviation of the pull, per axis.
            length_m: of the height's Matern covariance.
        """
        square = self.kx_rad_m[self.index[:, 0]] ** 2 + self.ky_rad_m[self.index[:, 1]] ** 2
        density = (2.0 * SMOOTHNESS / length_m**2 + square) ** -(SMOOTHNESS + 1.0)
        # a mode's squared gradient along an axis is k^2 / 8 on average over place and axes
        return np.asarray(density * (sigma_m_s2**2 / float((density * square / 8.0).sum())))
