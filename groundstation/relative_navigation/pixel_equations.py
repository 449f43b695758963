"""Pixels of points under a pose, and how they change with the pose."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.pinhole import PinholeCamera
from groundstation.relative_navigation.pose import Pose, Sight

Floats = NDArray[np.float64]

NEAREST_M = 1e-6
"""A point nearer than this, or behind the camera, has no picture."""


def predicted_pixels(camera: PinholeCamera, points_body_m: Floats, pose: Pose) -> Floats:
    """Return where points (n, 3) of the body fall, (n, 2); NaN for those behind the camera."""
    points = pose.points_camera_m(points_body_m)
    points[points[:, 2] < NEAREST_M] = np.nan
    return camera.project(points)


def jacobian(camera: PinholeCamera, points_body_m: Floats, pose: Pose) -> Floats:
    """Return the derivatives (n, 2, 6) of the pixels by position (m) and by the turn in front (rad).

    With R = C p, X = R + t and D = d(u, v)/dX the rows are [D, -D [R]x].
    """
    r = points_body_m @ pose.camera_from_body.T
    return _rows(camera.f_px, r, r + pose.position_camera_m)


def whitened(
    camera: PinholeCamera, points_body_m: Floats, sight: Sight, pose: Pose
) -> tuple[Floats, Floats] | None:
    """Return residuals (2 k,) and their model's derivatives (2 k, 6), in sigmas; None if a point is behind.

    Args:
        camera: The camera.
        points_body_m: Of the centres of the sight, (k, 3).
        sight: What was measured.
        pose: Where the derivatives are taken.
    """
    r = points_body_m @ pose.camera_from_body.T
    x = r + pose.position_camera_m
    if not x[:, 2].min() > NEAREST_M:
        return None
    rows = _rows(camera.f_px, r, x)
    off = sight.pixels - camera.project(x)
    if isinstance(sight.weights, float):
        rows *= sight.weights
        off *= sight.weights
    else:
        rows = sight.weights @ rows
        off = (sight.weights @ off[:, :, None])[:, :, 0]
    return off.ravel(), rows.reshape(-1, 6)


def cost_of(camera: PinholeCamera, points_body_m: Floats, sight: Sight, pose: Pose) -> float:
    """Return the sum of squares of the whitened residuals; infinite if a point is behind the camera."""
    x = points_body_m @ pose.camera_from_body.T + pose.position_camera_m
    if not x[:, 2].min() > NEAREST_M:
        return float("inf")
    off = sight.pixels - camera.project(x)
    if isinstance(sight.weights, float):
        return sight.weights**2 * float(off.ravel() @ off.ravel())
    off = (sight.weights @ off[:, :, None]).ravel()
    return float(off @ off)


def _rows(f_px: float, r: Floats, x: Floats) -> Floats:
    scale = f_px / x[:, 2]
    a, b = x[:, 0] / x[:, 2], x[:, 1] / x[:, 2]
    scale_a, scale_b = scale * a, scale * b
    rows = np.zeros((len(r), 2, 6))
    rows[:, 0, 0] = scale
    rows[:, 1, 1] = scale
    rows[:, 0, 2] = -scale_a
    rows[:, 1, 2] = -scale_b
    rows[:, 0, 3] = -scale_a * r[:, 1]
    rows[:, 0, 4] = scale * r[:, 2] + scale_a * r[:, 0]
    rows[:, 0, 5] = -scale * r[:, 1]
    rows[:, 1, 3] = -scale * r[:, 2] - scale_b * r[:, 1]
    rows[:, 1, 4] = scale_b * r[:, 0]
    rows[:, 1, 5] = scale * r[:, 0]
    return rows
