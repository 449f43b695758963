"""Fit of the surface to flights: its waviness and length by evidence, then its modes with covariance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

from calibration.outcome import CalibrationRefusedError
from calibration.table.equations import FlightEquations
from calibration.table.surface_basis import SurfaceBasis

Array = NDArray[np.float64]

TYPICAL_WAVINESS_M_S2, WAVINESS_FACTOR = 3e-4, 2.0
"""Median of the waviness of tables, and the factor that is one sigma; keeps sparse data from stating none."""
TYPICAL_LENGTH_M, LENGTH_FACTOR = 0.6, 2.0


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceFit:
    """Mean slope and waves of the table with their joint covariance."""

    basis: SurfaceBasis
    shared: Array
    """(2 + m,) slope m/s^2, amplitudes of the modes."""
    shared_covariance: Array
    """(2 + m, 2 + m)."""
    waviness_m_s2: float
    """Prior standard deviation of the pull about the slope, by evidence."""
    length_m: float
    chi_square_ratio: float
    """Of the whitened innovations over their number, with the noise as it was told; 1 is right."""
    noise_factor: float
    """What all noise was multiplied by to make that ratio at most 1."""
    rows: int
    unknowns_learned: float
    """Effective number of unknowns that the flights determined."""
    flights: tuple[FlightEquations, ...]

    def design(self, position_m: Array) -> Array:
        """Return (n, 2, 2 + m): acceleration at positions (n, 2) per shared unknown."""
        slope = np.broadcast_to(np.eye(2), (len(position_m), 2, 2))
        return np.concatenate([slope, self.basis.columns(position_m)], axis=2)

    def acceleration_m_s2(self, position_m: Array) -> Array:
        """Return the acceleration (n, 2) of a vehicle gliding at positions (n, 2), table frame."""
        return np.asarray(self.design(position_m) @ self.shared)

    def covariance(self, position_m: Array) -> Array:
        """Return its joint covariance (2 n, 2 n), x and y alternating."""
        A = self.design(position_m).reshape(2 * len(position_m), -1)
        return np.asarray(A @ self.shared_covariance @ A.T)

    def sigma_m_s2(self, position_m: Array) -> Array:
        """Return its standard deviations (n, 2)."""
        root = np.linalg.cholesky(
            self.shared_covariance
            + np.eye(len(self.shared_covariance)) * (1e-12 * self.shared_covariance.diagonal().max())
        )
        out = np.empty((len(position_m), 2))
        for k in range(0, len(position_m), 256):
            spread = self.design(position_m[k : k + 256]) @ root
            out[k : k + 256] = np.sqrt((spread**2).sum(axis=2))
        return out

    def mean_over(self, position_m: Array) -> tuple[Array, Array]:
        """Return the acceleration averaged over positions (n, 2): (2,) and its covariance (2, 2)."""
        A = np.zeros((2, len(self.shared)))
        for k in range(0, len(position_m), 512):
            A += self.design(position_m[k : k + 512]).sum(axis=0)
        A /= len(position_m)
        return A @ self.shared, A @ self.shared_covariance @ A.T


def fit_surface(
    flights: Sequence[FlightEquations], basis: SurfaceBasis, slope_sigma_m_s2: float = 0.02
) -> SurfaceFit:
    """Fit the surface to flights.

    Args:
        flights: their equations, with the field `basis`.
        basis: the modes.
        slope_sigma_m_s2: of the mean slope before anything is known; 0.02 is 2 mrad.

    Raises:
        CalibrationRefusedError: there are no flights.
    """
    if not flights:
        raise CalibrationRefusedError("there are no flights to learn from")
    factor = 1.0
    for _ in range(2):  # the second time with the noise that the first time has shown
        scaled = [flight.scaled(factor) for flight in flights]
        J = np.sum([flight.information for flight in scaled], axis=0)
        h = np.sum([flight.vector for flight in scaled], axis=0)
        waviness, length = _most_evident(J, h, basis, slope_sigma_m_s2)
        prior = _prior(basis, waviness, length, slope_sigma_m_s2)
        shared, covariance = _posterior(J, h, prior)
        learned = float(np.einsum("ij,ji->", covariance, J))
        rows = sum(flight.rows for flight in flights)
        power = sum(flight.power for flight in scaled)
        left = (power - 2.0 * float(h @ shared) + float(shared @ J @ shared)) * factor
        ratio = left / max(1.0, rows - learned)
        if ratio <= 1.0 or factor > 1.0:
            break
        factor = ratio
    return SurfaceFit(
        basis, shared, covariance, waviness, length, ratio, factor, rows, learned, tuple(scaled)
    )  # fmt: skip


def _prior(basis: SurfaceBasis, waviness: float, length: float, slope_sigma: float) -> Array:
    return np.concatenate([np.full(2, slope_sigma**2), basis.prior_variance(waviness, length)])


def _posterior(J: Array, h: Array, prior: Array) -> tuple[Array, Array]:
    root = np.sqrt(prior)
    B = np.eye(len(prior)) + root[:, None] * J * root
    inverse = cho_solve(cho_factor(B), np.eye(len(prior)))
    covariance = root[:, None] * inverse * root
    return covariance @ h, covariance


def cost_of_waves(J: Array, h: Array, basis: SurfaceBasis, slope_sigma: float, log: Array) -> float:
    """Return minus the logarithm of the marginal likelihood by the logarithms of waviness and length."""
    waviness, length = math.exp(log[0]), math.exp(log[1])
    root = np.sqrt(_prior(basis, waviness, length, slope_sigma))
    factor = cho_factor(np.eye(len(h)) + root[:, None] * J * root)
    scaled = root * h
    fit = float(scaled @ cho_solve(factor, scaled))
    volume = 2.0 * float(np.log(factor[0].diagonal()).sum())
    known = ((log[0] - math.log(TYPICAL_WAVINESS_M_S2)) / math.log(WAVINESS_FACTOR)) ** 2
    known += ((log[1] - math.log(TYPICAL_LENGTH_M)) / math.log(LENGTH_FACTOR)) ** 2
    return float(0.5 * (volume - fit + known))


def _most_evident(J: Array, h: Array, basis: SurfaceBasis, slope_sigma: float) -> tuple[float, float]:
    """Return waviness and length of largest marginal likelihood, with weak priors on their logarithms."""

    def cost(log: Array) -> float:
        return cost_of_waves(J, h, basis, slope_sigma, log)

    # shorter than this the modes that are left out would matter
    shortest = math.log(0.35 * basis.shortest_wave_m)
    start = np.array([math.log(TYPICAL_WAVINESS_M_S2), max(shortest, math.log(TYPICAL_LENGTH_M))])
    bounds = [(math.log(1e-6), math.log(1e-2)), (shortest, math.log(3.0))]
    found = minimize(cost, start, method="Nelder-Mead", bounds=bounds, options={"xatol": 0.02, "fatol": 0.02})
    return math.exp(found.x[0]), math.exp(found.x[1])
