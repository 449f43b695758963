"""Cramer-Rao bounds: how well a pose can be known at best, from the geometry and the noise of the centres."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.pinhole import PinholeCamera
from groundstation.relative_navigation.pixel_equations import jacobian
from groundstation.relative_navigation.pose import Pose

Floats = NDArray[np.float64]


def pose_bound(camera: PinholeCamera, points_body_m: Floats, pose: Pose, sigma_px: float) -> Floats:
    """Return the covariance (6, 6) that no unbiased estimate of one frame can beat; position m, turn rad.

    ``sigma^2 (sum of J' J)^-1`` over the points (n, 3), each measured with sigma_px in u and v.
    """
    rows = jacobian(camera, points_body_m, pose).reshape(-1, 6) / sigma_px
    bound: Floats = np.linalg.inv(rows.T @ rows).astype(np.float64, copy=False)
    return bound


def position_sigma_m(covariance: Floats) -> float:
    """Return the root of the summed position variances of a pose covariance (6, 6); NaN if it is none."""
    return _root(float(np.trace(covariance[:3, :3])))


def attitude_sigma_rad(covariance: Floats) -> float:
    """Return the root of the summed turn variances of a pose covariance (6, 6); NaN if it is none."""
    return _root(float(np.trace(covariance[3:, 3:])))


def _root(variance: float) -> float:
    return math.sqrt(variance) if variance >= 0.0 else math.nan
