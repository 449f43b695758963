"""Normal equations: solved with their covariance, which is widened to what the residuals were. Pure."""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse import csr_array

Array = NDArray[np.float64]


def surer(covariance: Array, parts: list[tuple[Array, Array, NDArray[np.intp]]]) -> Array:
    """Widen a covariance to that of scores summed over stretches of flight, which knows what no model does.

    Liang and Zeger, Biometrika 73, 1986.

    Args:
        covariance: By the model.
        parts: Whitened columns (m, c), whitened residuals (m,) and the stretch of each row.
    """
    scores = np.zeros((1 + max(int(stretch.max()) for _, _, stretch in parts), len(covariance)))
    for columns, left, stretch in parts:
        rows = csr_array((left, (stretch, np.arange(len(left)))), shape=(len(scores), len(left)))
        scores[:, : columns.shape[1]] += np.asarray(rows @ columns)
    sandwich = covariance @ (scores.T @ scores) @ covariance
    wider = np.sqrt(np.maximum(1.0, sandwich.diagonal() / covariance.diagonal()))
    return np.asarray(covariance * np.outer(wider, wider))


def widened(normal: Array, right: Array, more: int) -> tuple[Array, Array]:
    """Normal equations with room for more unknowns behind."""
    return np.pad(normal, (0, more)), np.pad(right, (0, more))


def solved(normal: Array, right: Array) -> tuple[Array, Array]:
    """Return the solution of normal equations and its covariance; unknowns are scaled to one size first."""
    size = np.sqrt(np.diag(normal))
    size[size == 0.0] = 1.0
    scaled = normal / np.outer(size, size)
    scaled[np.diag_indices_from(scaled)] += 1e-12
    factor = cho_factor(scaled)
    covariance = cho_solve(factor, np.eye(len(size))) / np.outer(size, size)
    return cho_solve(factor, right / size) / size, covariance
