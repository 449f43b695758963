"""How well turning told the accelerometers' bias from the table's slope, in words."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.table.chain import BIAS
from calibration.table.surface_fit import SurfaceFit

Array = NDArray[np.float64]

TOO_ALIKE = 0.95
ENOUGH_M_S2 = 5e-4
"""Sigma of slope or bias (0.05 mrad) below which their correlation does not matter."""


@dataclass(frozen=True, slots=True)
class Separability:
    """Bias against slope in one flight."""

    flight: str
    turned_rad: float
    bias_m_s2: tuple[float, float]
    bias_std_m_s2: tuple[float, float]
    slope_std_m_s2: tuple[float, float]
    correlation: float
    """Largest canonical correlation of bias and slope."""

    @property
    def is_separated(self) -> bool:
        """Whether bias and slope are told apart well enough for a map."""
        return self.correlation < TOO_ALIKE or max(self.slope_std_m_s2) < ENOUGH_M_S2

    def sentence(self) -> str:
        """Return the verdict in words."""
        turned = math.degrees(self.turned_rad)
        spread = 1e3 * max(self.slope_std_m_s2)
        if self.is_separated:
            return (
                f"{self.flight}: the heading turned through {turned:.0f}°, bias and slope are separated "
                f"(correlation {self.correlation:.2f}, slope ± {spread:.2f} mm/s²)."
            )
        return (
            f"{self.flight}: the heading turned through only {turned:.0f}°, so that accelerometer bias and "
            f"mean slope cannot be told apart (correlation {self.correlation:.3f}, slope ± {spread:.1f} "
            "mm/s²). Fly laps with all headings; the waves of the map do not suffer, its mean does."
        )


def separability(fit: SurfaceFit) -> list[Separability]:
    """Judge each flight of a fit."""
    out = []
    slope_cov = fit.cov[:2, :2]
    for flight in fit.flights:
        value, cov = flight.unknowns(fit.shared, fit.cov)
        bias_cov = cov[BIAS, BIAS]
        cross = -(flight.response @ fit.cov)[BIAS, :2]
        bias_root, slope_root = np.linalg.cholesky(bias_cov), np.linalg.cholesky(slope_cov)
        whitened = np.linalg.solve(slope_root, np.linalg.solve(bias_root, cross).T)
        correlation = float(np.linalg.svd(whitened, compute_uv=False)[0])
        bias_std, slope_std = np.sqrt(bias_cov.diagonal()), np.sqrt(slope_cov.diagonal())
        out.append(
            Separability(
                flight=flight.name,
                turned_rad=flight.headings_rad,
                bias_m_s2=(float(value[0]), float(value[1])),
                bias_std_m_s2=(float(bias_std[0]), float(bias_std[1])),
                slope_std_m_s2=(float(slope_std[0]), float(slope_std[1])),
                correlation=correlation,
            )
        )
    return out
