"""The published solver: Newton's method on (x, y, z, q1, q2, q3) with the whole matrix of second derivatives.

Ivanov, Karpenko, Ovchinnikov 2012 (Chibis-M), section 2.2: the sum of squares over the seen points is made
least by ``f <- f - [d2 Phi / df df]^-1 dPhi/df`` until each parameter moves by less than its accuracy. The
scalar part of the quaternion is ``q0 = sqrt(1 - q1^2 - q2^2 - q3^2)``: half a turn is singular,
and without a start close enough the matrix need not be positive. That is how it was published;
`levenberg` has neither weakness.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.levenberg import PosePrior
from groundstation.relative_navigation.pinhole import PinholeCamera
from groundstation.relative_navigation.pixel_equations import NEAREST_M, whitened
from groundstation.relative_navigation.pose import Pose, PoseFit, Sight
from groundstation.relative_navigation.rotations import matrix_of

Floats = NDArray[np.float64]

ACCURACY = np.array((1e-7, 1e-7, 1e-7, 1e-8, 1e-8, 1e-8))
"""The published eps0, m and parts of a quaternion; no values are published: assumed."""
MOST_ITERATIONS = 50
_LEAST_Q0 = 1e-6


def solve_newton(
    camera: PinholeCamera,
    points_body_m: Floats,
    sight: Sight,
    start: Pose,
    prior: PosePrior | None = None,
) -> PoseFit:
    """Return the pose by the published method; ``converged`` is false where it runs away.

    Args:
        camera: The camera.
        points_body_m: All points of the target, (n, 3).
        sight: Which of them were seen, and where; all count alike, as published.
        start: Where it begins.
        prior: Not used: the published method knows none.
    """
    del prior
    points = points_body_m[sight.point]
    q = start.quaternion
    f = np.concatenate((start.position_camera_m, q[1:]))
    for iteration in range(1, MOST_ITERATIONS + 1):
        if float(f[3:] @ f[3:]) > 1.0 - _LEAST_Q0**2:
            return _lost(start, iteration)
        found = _derivatives(camera, points, sight.pixels, f)
        if found is None:
            return _lost(start, iteration)
        gradient, hessian = found
        try:
            step = -np.linalg.solve(hessian, gradient)
        except np.linalg.LinAlgError:
            return _lost(start, iteration)
        f = f + step
        if not np.all(np.isfinite(f)):
            return _lost(start, iteration)
        if np.all(np.abs(step) < ACCURACY):
            return _finished(camera, points, sight, f, start, iteration)
    return _lost(start, MOST_ITERATIONS)


def _finished(
    camera: PinholeCamera, points: Floats, sight: Sight, f: Floats, start: Pose, iteration: int
) -> PoseFit:
    if float(f[3:] @ f[3:]) > 1.0:
        return _lost(start, iteration)
    pose = Pose(matrix_of(_quaternion(f)), f[:3])
    found = whitened(camera, points, sight, pose)
    if found is None:
        return _lost(start, iteration)
    off, rows = found
    try:
        covariance = np.linalg.inv(rows.T @ rows).astype(np.float64, copy=False)
    except np.linalg.LinAlgError:
        return _lost(start, iteration)
    return PoseFit(pose, covariance, float(off @ off), iteration, converged=True)


def _lost(start: Pose, iterations: int) -> PoseFit:
    return PoseFit(start, np.full((6, 6), np.nan), float("inf"), iterations, converged=False)


def _quaternion(f: Floats) -> Floats:
    return np.concatenate(([math.sqrt(max(0.0, 1.0 - float(f[3:] @ f[3:])))], f[3:]))


def _derivatives(
    camera: PinholeCamera, points: Floats, pixels: Floats, f: Floats
) -> tuple[Floats, Floats] | None:
    """Gradient (6,) and second derivatives (6, 6) of the sum of squares, px^2."""
    q = _quaternion(f)
    forms = _quadratic_forms(points)  # X_a = q M_a q
    half = forms @ q
    x = half @ q + f[:3]
    if not x[:, 2].min() > NEAREST_M:
        return None
    # q0 as a function of the vector part: first and second derivatives
    dq = np.zeros((4, 3))
    dq[0], dq[1:] = -q[1:] / q[0], np.eye(3)
    ddq0 = -(np.eye(3) / q[0] + np.outer(q[1:], q[1:]) / q[0] ** 3)
    dx = np.zeros((len(points), 3, 6))
    dx[:, :, :3] = np.eye(3)
    dx[:, :, 3:] = 2.0 * half @ dq
    ddx = np.zeros((len(points), 3, 6, 6))
    ddx[:, :, 3:, 3:] = 2.0 * (dq.T @ forms @ dq) + 2.0 * half[:, :, 0, None, None] * ddq0
    scale = camera.f_px / x[:, 2]
    plane = x[:, :2] / x[:, 2:]
    off = pixels - camera.project(x)
    first = np.zeros((len(points), 2, 3))
    first[:, 0, 0] = first[:, 1, 1] = scale
    first[:, :, 2] = -scale[:, None] * plane
    second = np.zeros((len(points), 2, 3, 3))
    for row in range(2):
        second[:, row, row, 2] = second[:, row, 2, row] = -scale / x[:, 2]
        second[:, row, 2, 2] = 2.0 * scale * plane[:, row] / x[:, 2]
    rows = first @ dx
    gradient = -2.0 * np.einsum("ki,kij->j", off, rows)
    bend = np.einsum("kiab,kaj,kbl->kijl", second, dx, dx) + np.einsum("kia,kajl->kijl", first, ddx)
    hessian = 2.0 * np.einsum("kij,kil->jl", rows, rows) - 2.0 * np.einsum("ki,kijl->jl", off, bend)
    return gradient, hessian


def _quadratic_forms(points: Floats) -> Floats:
    """Symmetric matrices (n, 3, 4, 4): component a of ``C(q) p`` is ``q M_a q``."""
    x, y, z = points.T
    o = np.zeros_like(x)
    forms = np.array(
        [
            [[x, o, z, -y], [o, x, y, z], [z, y, -x, o], [-y, z, o, -x]],
            [[y, -z, o, x], [-z, -y, x, o], [o, x, y, z], [x, o, z, -y]],
            [[z, y, -x, o], [y, -z, o, x], [-x, o, -z, y], [o, x, y, z]],
        ]
    )
    found: Floats = forms.transpose(3, 0, 1, 2)
    return found
