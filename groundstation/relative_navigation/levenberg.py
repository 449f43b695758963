"""The pose of least squares by Levenberg and Marquardt, turns on the exponential map: the default solver.

Started from a prediction it is Gauss and Newton's method: damping comes in only where a step makes things
worse. With a prior it gives the most probable pose of prediction and frame together. The core does it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.core.library import default_core
from groundstation.relative_navigation.pinhole import PinholeCamera
from groundstation.relative_navigation.pixel_equations import NEAREST_M
from groundstation.relative_navigation.pose import Pose, PoseFit, Sight

Floats = NDArray[np.float64]

REST = 1e-8
"""A step whose square in units of the covariance is below this moves nothing: a ten-thousandth of a sigma."""
MOST_ITERATIONS = 60
FIRST_DAMPING = 1e-3
MOST_DAMPING = 1e12
_MOST_INFLATION = 1e13
"""Of a variance by what else is unknown: beyond it the frame says nothing about a direction of the pose."""


@dataclass(frozen=True, slots=True, eq=False)
class PosePrior:
    """What is believed of a pose before looking.

    Attributes:
        mean: The prediction.
        information: Inverse of its covariance, (6, 6).
    """

    mean: Pose
    information: Floats


@cache
def _settings() -> Any:  # noqa: ANN401 - a structure of the core
    return default_core().ffi.new(
        "PoseSettings *",
        {
            "rest": REST,
            "first_damping": FIRST_DAMPING,
            "most_damping": MOST_DAMPING,
            "most_inflation": _MOST_INFLATION,
            "nearest_m": NEAREST_M,
            "iterations": MOST_ITERATIONS,
        },
    )


def solve_levenberg(
    camera: PinholeCamera,
    points_body_m: Floats,
    sight: Sight,
    start: Pose,
    prior: PosePrior | None = None,
) -> PoseFit:
    """Return the pose of least squares near a start.

    Args:
        camera: The camera.
        points_body_m: All points of the target, (n, 3).
        sight: Which of them were seen, and where.
        start: Where the search begins; all points must lie in front of the camera.
        prior: What is known beside the frame.

    Returns:
        The fit; its cost counts the prior, too; ``converged`` is false where it did not come to rest, or
        where the frame leaves a direction of the pose unknown.
    """
    core = default_core()
    ffi = core.ffi
    seen = np.zeros((len(sight.point), 9))
    seen[:, :3] = points_body_m[sight.point]
    seen[:, 3:5] = sight.pixels
    if isinstance(sight.weights, float):
        seen[:, 5] = seen[:, 8] = sight.weights
    else:
        seen[:, 5:] = sight.weights.reshape(-1, 4)
    lens = ffi.new("Pinhole *", (camera.f_px, camera.cx_px, camera.cy_px))
    found = ffi.new("SolvedPose *")
    numbers = np.frombuffer(ffi.buffer(found), dtype=np.float64, count=48)
    numbers[:9], numbers[9:12] = start.camera_from_body.ravel(), start.position_camera_m
    mean, information, kept = ffi.NULL, ffi.NULL, None
    if prior is not None:
        kept = np.concatenate(
            (prior.mean.camera_from_body.ravel(), prior.mean.position_camera_m, prior.information.ravel())
        )
        mean = ffi.cast("RigidPose *", kept.ctypes.data)
        information = ffi.cast("double *", kept.ctypes.data + 12 * kept.itemsize)
    converged = core.lib.gs_solve_pose(
        lens, ffi.cast("SeenPoint *", seen.ctypes.data), len(seen), mean, information, _settings(), found
    )
    pose = Pose(numbers[:9].reshape(3, 3).copy(), numbers[9:12].copy())
    if not converged:
        return PoseFit(pose, np.full((6, 6), np.nan), found.cost, found.iterations, converged=False)
    covariance = numbers[12:48].reshape(6, 6).copy()
    return PoseFit(pose, covariance, found.cost, found.iterations, converged=True)
