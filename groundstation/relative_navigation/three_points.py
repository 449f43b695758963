"""Poses from three points: up to four solutions of each triple, many triples at once.

Grunert's equations as collected by Haralick, Lee, Ottenberg, Nolle (1994): a quartic in the ratio of two
distances.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_REAL = 1e-3
"""Imaginary share below which a root counts as real: noise makes double roots a little complex."""


def poses_of_triples(points: Floats, rays: Floats) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Return every pose that puts three points on three rays.

    Args:
        points: Body axes, (n, 3, 3): triple, point, axis.
        rays: Unit vectors in camera axes, (n, 3, 3).

    Returns:
        Rotations (m, 3, 3), positions (m, 3), and which triple each belongs to, (m,).
    """
    a2, b2, c2 = (np.sum((points[:, i] - points[:, j]) ** 2, axis=1) for i, j in ((1, 2), (0, 2), (0, 1)))
    alpha, beta, gamma = (np.sum(rays[:, i] * rays[:, j], axis=1) for i, j in ((1, 2), (0, 2), (0, 1)))
    k, a, c = (a2 - c2) / b2, a2 / b2, c2 / b2
    coefficients = np.stack(
        (
            (k - 1.0) ** 2 - 4.0 * c * alpha**2,
            4.0 * (k * (1.0 - k) * beta - (1.0 - a - c) * alpha * gamma + 2.0 * c * alpha**2 * beta),
            2.0
            * (
                k**2
                - 1.0
                + 2.0 * k**2 * beta**2
                + 2.0 * (1.0 - c) * alpha**2
                - 4.0 * (a + c) * alpha * beta * gamma
                + 2.0 * (1.0 - a) * gamma**2
            ),
            4.0 * (-k * (1.0 + k) * beta + 2.0 * a * gamma**2 * beta - (1.0 - a - c) * alpha * gamma),
            (1.0 + k) ** 2 - 4.0 * a * gamma**2,
        ),
        axis=1,
    )
    roots = _quartic_roots(coefficients)
    v = roots.real
    down = 2.0 * (gamma[:, None] - v * alpha[:, None])
    down = np.where(np.abs(down) < 1e-12, 1e-12, down)
    k_, beta_ = k[:, None], beta[:, None]
    u = ((k_ - 1.0) * v**2 - 2.0 * k_ * beta_ * v + 1.0 + k_) / down
    square = b2[:, None] / (1.0 + v**2 - 2.0 * v * beta_)
    good = (np.abs(roots.imag) < _REAL * (1.0 + np.abs(v))) & (v > 0.0) & (u > 0.0) & (square > 0.0)
    triple, root = np.nonzero(good)
    first = np.sqrt(square[triple, root])
    distances = np.stack((first, first * u[triple, root], first * v[triple, root]), axis=1)
    seen = distances[:, :, None] * rays[triple]
    rotation = _frames(seen) @ _frames(points[triple]).transpose(0, 2, 1)
    position = seen.mean(axis=1) - np.einsum("mij,mj->mi", rotation, points[triple].mean(axis=1))
    return rotation, position, triple.astype(np.int64)


def _quartic_roots(coefficients: Floats) -> NDArray[np.complex128]:
    """Roots (n, 4) of quartics (n, 5), highest power first."""
    lead = coefficients[:, :1]
    lead = np.where(np.abs(lead) < 1e-12, 1e-12, lead)
    companion = np.zeros((len(coefficients), 4, 4))
    companion[:, 0] = -coefficients[:, 1:] / lead
    companion[:, range(1, 4), range(3)] = 1.0
    return np.linalg.eigvals(companion).astype(np.complex128)


def _frames(corners: Floats) -> Floats:
    """Axes (m, 3, 3) of triangles (m, 3, 3)."""
    x = corners[:, 1] - corners[:, 0]
    z = np.cross(x, corners[:, 2] - corners[:, 0])
    x = x / np.linalg.norm(x, axis=1, keepdims=True)
    z = z / np.maximum(np.linalg.norm(z, axis=1, keepdims=True), 1e-12)
    return np.stack((x, np.cross(z, x), z), axis=2)
