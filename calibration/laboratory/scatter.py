"""What a flight scatters by: moments of opening in the forces, white noise and a walk in the rate."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded, solve_banded
from scipy.optimize import minimize
from scipy.sparse import csr_array

Array = NDArray[np.float64]

LEAST_WALK_RAD_S = 1e-8
GAP_RAD_S = 1.0
"""What may have happened to the rate where packets are not looked at."""


@dataclass(frozen=True, slots=True, eq=False)
class Moments:
    """What residuals say of the moments of opening.

    Attributes:
        moved: (2 n,) what of the residuals they explain.
        jitter_s: Their scatter.
        seen: Effective number of openings that told it.
    """

    moved: Array
    jitter_s: float
    seen: float


class PulseScatter:
    """One unknown per opening, how much later it was; only openings near each other share packets.

    Args:
        columns: (2 n, p) derivatives of the forces by the moments, openings in the order of time.
        weight: (2 n,) one over the scatter of each force; zero where it is not looked at.
        jitter_s: What is taken for the scatter of the moments.
    """

    def __init__(self, columns: csr_array, weight: Array, jitter_s: float) -> None:
        self._columns, self._weight, self._jitter_s = columns, weight, jitter_s
        self._white = columns.multiply(weight[:, None]).tocsr()
        square = (self._white.T @ self._white).tocoo()
        width = int(np.abs(square.row - square.col).max()) if square.nnz else 0
        bands = np.zeros((width + 1, columns.shape[1]))
        low = square.row >= square.col
        bands[square.row[low] - square.col[low], square.col[low]] = square.data[low]
        bands[0] += 1.0 / jitter_s**2
        self._factor = cholesky_banded(bands, lower=True), True

    def reduced(self, columns: Array, left: Array) -> tuple[Array, Array]:
        """Normal equations of other unknowns (2 n, c) with the moments eliminated: (c, c) and (c,)."""
        white = columns * self._weight[:, None]
        rest = left * self._weight
        mixed = self._white.T @ np.column_stack([white, rest])
        eliminated = mixed[:, :-1].T @ cho_solve_banded(self._factor, mixed)
        normal = white.T @ white - eliminated[:, :-1]
        return normal, white.T @ rest - eliminated[:, -1]

    def moments(self, left: Array) -> Moments:
        """What is left (2 n,) when the others are known, as moments of opening."""
        found = cho_solve_banded(self._factor, self._white.T @ (left * self._weight))
        size = self._columns.shape[1]
        variance = cho_solve_banded(self._factor, np.eye(size)).diagonal()
        seen = float(np.sum(1.0 - variance / self._jitter_s**2))
        jitter_s = math.sqrt(float((found**2).sum()) / seen) if seen > 1.0 else self._jitter_s
        return Moments(self._columns @ found, jitter_s, seen)


class RateWhitener:
    """Makes the differences of a rate that walks, read with white noise, independent and of one size.

    Args:
        n: Packets.
        noise_rad_s: White noise of a packet.
        walk_rad_s: What the rate walks from packet to packet.
        openings: (n,) sum of squared turns, (rad/s^2)^2, of valves that open within a packet.
        jitter_s: Scatter of their moments.
        is_hidden: (n,) packets that are not looked at.
    """

    def __init__(
        self,
        n: int,
        noise_rad_s: float,
        walk_rad_s: float,
        openings: Array,
        jitter_s: float,
        is_hidden: NDArray[np.bool_],
    ) -> None:
        self._noise, self._walk = noise_rad_s, walk_rad_s
        jumps = openings * jitter_s**2 + np.where(is_hidden, GAP_RAD_S**2, 0.0)
        self._jumps = jumps[1:] + np.where(is_hidden[:-1], GAP_RAD_S**2, 0.0)
        self._lower = self._factor(noise_rad_s, walk_rad_s)

    def _factor(self, noise: float, walk: float) -> Array:
        bands = np.empty((2, len(self._jumps)))
        bands[0] = self._jumps + walk**2 + 2.0 * noise**2
        bands[1] = -(noise**2)
        return np.asarray(cholesky_banded(bands, lower=True))

    def __call__(self, columns: Array) -> Array:
        """Whiten the differences of (n, c): (n - 1, c)."""
        return np.asarray(solve_banded((1, 0), self._lower, np.diff(columns, axis=0)))

    def likeliest(self, left: Array) -> tuple[float, float]:
        """Noise and walk, rad/s, that make residuals (n,) most likely."""
        steps = np.diff(left)

        def cost(logarithms: Array) -> float:
            lower = self._factor(*np.exp(logarithms).tolist())
            white = solve_banded((1, 0), lower, steps)
            return 2.0 * float(np.log(lower[0]).sum()) + float(white @ white)

        start = np.log([self._noise, max(LEAST_WALK_RAD_S, self._walk)])
        bounds = [(math.log(1e-7), 0.0), (math.log(LEAST_WALK_RAD_S), 0.0)]
        found = minimize(
            cost,
            start,
            method="Nelder-Mead",
            bounds=bounds,
            options={"xatol": 1e-3, "fatol": 1e-3, "maxfev": 60},
        )
        noise, walk = np.exp(found.x).tolist()
        return float(noise), float(walk)

    def slow(self, left: Array) -> Array:
        """The walk in residuals (n,): smoothed between all of them."""
        n = len(left)
        stiff = 1.0 / (self._jumps + self._walk**2)
        bands = np.zeros((2, n))
        seen = 1.0 / self._noise**2
        bands[0] = seen
        bands[0, :-1] += stiff
        bands[0, 1:] += stiff
        bands[1, :-1] = -stiff
        factor = cholesky_banded(bands, lower=True), True
        return np.asarray(cho_solve_banded(factor, left * seen))
