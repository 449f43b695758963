"""What the headings differ from an integrated gyro by: noise, jitter of the pictures, and a random walk.

The sum of a white gyro's samples walks: two differences between heading and sum lie farther apart the
longer it is between them. Taken for white noise this walk would make any parameter look several times
better known than it is. Differences of successive headings have independent steps of the walk and a
tridiagonal covariance, so that the likelihood costs a number of operations in proportion to theirs.
The three sizes are restricted maximum likelihood (Patterson and Thompson, 1971).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky_banded, solve_banded
from scipy.optimize import minimize

Array = NDArray[np.float64]

_FLOOR_RAD2 = 1e-18
_SEEN_BY = 4.0  # of twice the log-likelihood: two sigma
_NONE = -46.0  # logarithm of a variance that is none


@dataclass(frozen=True, slots=True, eq=False)
class HeadingNoise:
    """Sizes of the three.

    Attributes:
        heading_rad2: Variance of each heading.
        jitter_s2: Variance by which pictures come earlier or later.
        walk_rad2_s: Variance by which the integrated gyro walks off in each second.
    """

    heading_rad2: float
    jitter_s2: float
    walk_rad2_s: float

    def whiten(self, t_s: Array, rate_rad_s: Array, columns: Array) -> tuple[Array, float]:
        """Difference rows and scale them to unit covariance.

        Args:
            t_s: Times, rising, shape (n,).
            rate_rad_s: Turn rates, shape (n,).
            columns: What to whiten, shape (n, k).

        Returns:
            Whitened differences, shape (n - 1, k), and the logarithm of the covariance's determinant.
        """
        variance = np.maximum(self.heading_rad2 + self.jitter_s2 * rate_rad_s**2, _FLOOR_RAD2)
        band = np.zeros((2, len(t_s) - 1))
        band[0] = variance[1:] + variance[:-1] + self.walk_rad2_s * np.diff(t_s)
        band[1, :-1] = -variance[1:-1]
        lower = cholesky_banded(band, lower=True, check_finite=False)
        white = solve_banded((1, 0), lower, np.diff(columns, axis=0), check_finite=False)
        return np.asarray(white, dtype=np.float64), 2.0 * float(np.log(lower[0]).sum())


def gyro_walk_rad2_s(t_s: Array, rate_rad_s: Array) -> float:
    """What the walk is at least: the gyro's scatter by second differences, in which no turn shows."""
    if len(t_s) < 3:
        return 0.0
    scatter = 1.4826 * float(np.median(np.abs(np.diff(rate_rad_s, 2)))) / np.sqrt(6.0)
    return float(scatter**2 * np.median(np.diff(t_s)))


def fit_noise(
    t_s: Array, rate_rad_s: Array, residual_rad: Array, design: Array, walk_rad2_s: float
) -> HeadingNoise:
    """Find the sizes; a jitter that the residuals do not show is 0.

    Args:
        t_s: Times, rising, shape (n,).
        rate_rad_s: Turn rates, shape (n,).
        residual_rad: Headings minus a model near the best, shape (n,).
        design: Derivatives of the model by its parameters but the offset, shape (n, k).
        walk_rad2_s: What the walk is at least.
    """
    columns = np.column_stack((residual_rad, design))

    def cost(noise: HeadingNoise) -> float:
        white, log_determinant = noise.whiten(t_s, rate_rad_s, columns)
        basis, corner = np.linalg.qr(white[:, 1:])
        rest = white[:, 0] - basis @ (basis.T @ white[:, 0])
        return log_determinant + 2.0 * float(np.log(np.abs(np.diag(corner))).sum()) + float(rest @ rest)

    def noise_of(logarithms: Array) -> HeadingNoise:
        heading, walk, jitter = np.exp(np.clip(logarithms, _NONE, 10.0))
        return HeadingNoise(float(heading), float(jitter), float(walk) + walk_rad2_s)

    def fit(start: Array, is_free: bool) -> tuple[Array, float]:
        def of(sizes: Array) -> float:
            return cost(noise_of(sizes if is_free else np.append(sizes, -np.inf)))

        found = minimize(of, start, method="Nelder-Mead", options={"xatol": 0.05, "fatol": 0.02})
        return np.asarray(found.x, dtype=np.float64), float(found.fun)

    spread = max(float(np.var(residual_rad)), _FLOOR_RAD2)
    start = np.log([spread, 0.1 * spread, 1e-6])
    still, cost_still = fit(start[:2], is_free=False)
    free, cost_free = fit(start, is_free=True)
    if cost_free < cost_still - _SEEN_BY:
        return noise_of(free)
    found = noise_of(np.append(still, -np.inf))
    return HeadingNoise(found.heading_rad2, 0.0, found.walk_rad2_s)
