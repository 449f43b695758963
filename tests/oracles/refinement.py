"""Pose from matched stars: robust weighted least squares with a covariance that is true.

The unknowns are a small motion (dx, dy, dheading) of the body in its own axes. Spot and star differ by
``e = R(-heading) (star - position) - q``, whose covariance is the spot's, carried to the ceiling by the
camera's Jacobian, plus the star's own; it does not depend on the heading as long as stars are known
alike along both axes, so that all weights are made once.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.star_tracking.tracker_settings import CLIP_SIGMAS, PRIOR_FREEDOM, REFINE_STEPS

Complex = NDArray[np.complex128]
Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """A refined pose.

    Attributes:
        turn: exp(i heading).
        shift_m: Body origin x + iy in the table.
        covariance: Covariance (3, 3) of (x, y, heading), table axes.
        kept: Which of the matches were used, shape (n,).
        scale: Ratio of found to expected residuals (sigma, not variance).
    """

    turn: complex
    shift_m: complex
    covariance: Array
    kept: NDArray[np.bool_]
    scale: float


def refine(q_body_m: Complex, star_m: Complex, covariance_m2: Array, turn: complex, shift_m: complex) -> Pose:
    """Fit the pose to matches.

    Args:
        q_body_m: Spots on the ceiling, body axes, shape (n,).
        star_m: Their stars, table, shape (n,).
        covariance_m2: Covariance of spot minus star, body axes, shape (n, 2, 2).
        turn: First guess, exp(i heading).
        shift_m: First guess of the body origin.
    """
    n = len(q_body_m)
    weight = _inverse(covariance_m2)
    lever = np.zeros((n, 2, 3))
    lever[:, 0, 0] = lever[:, 1, 1] = 1.0
    lever[:, 0, 2], lever[:, 1, 2] = -q_body_m.imag, q_body_m.real
    weighted = weight @ lever
    normal = (lever.transpose(0, 2, 1) @ weighted).reshape(n, 9)
    kept = np.ones(n)
    scale2 = 1.0
    e = _error(q_body_m, star_m, turn, shift_m)
    for _ in range(REFINE_STEPS):
        gradient = np.einsum("nij,ni->nj", weighted, e)
        information = _weighted_sum(kept, normal)
        step = np.linalg.solve(information, kept @ gradient)
        shift_m = shift_m + turn * complex(step[0], step[1])
        turn = turn * np.exp(1j * step[2])
        e = _error(q_body_m, star_m, turn, shift_m)
        distance2 = ((weight @ e[:, :, None])[:, :, 0] * e).sum(axis=1)
        fresh, scale2 = _clip(distance2)
        if np.array_equal(fresh, kept) and abs(step[2]) < 1e-7:
            break
        kept = fresh
    information = _weighted_sum(kept, normal)
    rotation = np.eye(3)
    rotation[:2, :2] = [[turn.real, -turn.imag], [turn.imag, turn.real]]
    covariance = rotation @ (np.linalg.inv(information) * scale2) @ rotation.T
    return Pose(
        complex(turn), complex(shift_m), 0.5 * (covariance + covariance.T), kept > 0.5, float(np.sqrt(scale2))
    )


def _error(q_body_m: Complex, star_m: Complex, turn: complex, shift_m: complex) -> Array:
    """Give star minus spot in body axes, shape (n, 2)."""
    error = np.ascontiguousarray(np.conj(turn) * (star_m - shift_m) - q_body_m)
    return error.view(np.float64).reshape(-1, 2)


def _weighted_sum(kept: Array, normal: Array) -> Array:
    return np.asarray((kept @ normal).reshape(3, 3))


def _clip(distance2: Array) -> tuple[Array, float]:
    """Drop residuals beyond the clip of the robust scale; give the variance scale of the rest."""
    n = len(distance2)
    # Of three unknowns n stars keep 2n - 3 degrees of freedom: small samples look better than they are.
    freedom = max(2.0 * n - 3.0, 1.0)
    robust = float(np.sort(distance2)[n // 2]) / 1.386 * (2.0 * n / freedom)
    limit = CLIP_SIGMAS**2 * max(robust, 0.5) * 1.3
    kept = distance2 <= limit
    if int(kept.sum()) < 3:
        kept = distance2 <= np.sort(distance2)[min(2, n - 1)]
    freedom = max(2.0 * float(kept.sum()) - 3.0, 0.0)
    total = float(distance2[kept].sum())
    return kept.astype(np.float64), (PRIOR_FREEDOM + total) / (PRIOR_FREEDOM + freedom)


def _inverse(matrix: Array) -> Array:
    """Invert symmetric 2x2 matrices, shape (n, 2, 2)."""
    a, b, c = matrix[:, 0, 0], matrix[:, 0, 1], matrix[:, 1, 1]
    inverse = np.empty_like(matrix)
    determinant = a * c - b * b
    inverse[:, 0, 0], inverse[:, 1, 1] = c / determinant, a / determinant
    inverse[:, 0, 1] = inverse[:, 1, 0] = -b / determinant
    return inverse
