"""How well turning told the accelerometers' bias from the table's slope, in words."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.table.chain import BIAS
from calibration.table.surface_fit import SurfaceFit

Array = NDArray[np.float64]

ALIKE = 0.8
ENOUGH_M_S2 = 3e-4
"""Sigma of the pull (0.03 mrad) below which it does not matter what it is correlated with."""


@dataclass(frozen=True, slots=True)
class Separability:
    """The accelerometers' bias against the table's pull in the middle of one flight."""

    flight: str
    turned_rad: float
    bias_m_s2: tuple[float, float]
    bias_sigma_m_s2: tuple[float, float]
    pull_sigma_m_s2: tuple[float, float]
    correlation: float
    """Largest canonical correlation of bias and pull."""

    @property
    def is_separated(self) -> bool:
        """Whether the pull is known well enough for a map, whatever the bias is."""
        return max(self.pull_sigma_m_s2) < ENOUGH_M_S2

    def sentence(self) -> str:
        """Return the verdict in words."""
        turned = f"{math.degrees(self.turned_rad):.0f}°"
        known = f"(correlation {self.correlation:.2f}, slope ± {1e3 * max(self.pull_sigma_m_s2):.2f} mm/s²)"
        if self.is_separated:
            return (
                f"{self.flight}: the heading turned through {turned}, bias and slope are separated {known}."
            )
        if self.correlation > ALIKE:
            return (
                f"{self.flight}: the heading turned through only {turned}, so that accelerometer bias and "
                f"slope cannot be told apart {known}. Fly laps with all headings; the waves of the map do "
                "not suffer, its mean does."
            )
        return f"{self.flight}: too short or too seldom seen by the stars to tell the slope {known}."


def separability(fit: SurfaceFit) -> list[Separability]:
    """Judge each flight of a fit."""
    out = []
    for flight in fit.flights:
        value, covariance = flight.unknowns(fit.shared, fit.shared_covariance)
        A = fit.design(flight.centre_m[None])[0]
        bias_covariance, pull_covariance = covariance[BIAS, BIAS], A @ fit.shared_covariance @ A.T
        cross = -(flight.response @ fit.shared_covariance)[BIAS] @ A.T
        bias_root, pull_root = np.linalg.cholesky(bias_covariance), np.linalg.cholesky(pull_covariance)
        whitened = np.linalg.solve(pull_root, np.linalg.solve(bias_root, cross).T)
        correlation = float(np.linalg.svd(whitened, compute_uv=False)[0])
        bias_sigma, pull_sigma = np.sqrt(bias_covariance.diagonal()), np.sqrt(pull_covariance.diagonal())
        out.append(
            Separability(
                flight=flight.name,
                turned_rad=flight.headings_rad,
                bias_m_s2=(float(value[0]), float(value[1])),
                bias_sigma_m_s2=(float(bias_sigma[0]), float(bias_sigma[1])),
                pull_sigma_m_s2=(float(pull_sigma[0]), float(pull_sigma[1])),
                correlation=correlation,
            )
        )
    return out
