"""The second pose of coplanar points: seen from far, a plane tilted either way looks alike."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.pose import Pose

Floats = NDArray[np.float64]


def twin_of(pose: Pose, points_body_m: Floats, normal_body: Floats) -> Pose:
    """Return where the search for the other pose begins.

    The depths of the points along the line of sight change sign; ``C' = (1 - 2 l l') C (1 - 2 n n')`` with
    the line of sight l to their middle and their normal n, and the middle stays.

    Args:
        pose: One of the two.
        points_body_m: The coplanar points, (n, 3).
        normal_body: Unit vector (3,).
    """
    middle = points_body_m.mean(axis=0)
    place = pose.camera_from_body @ middle + pose.position_camera_m
    sight = place / np.linalg.norm(place)
    eye = np.eye(3)
    rotation = (
        (eye - 2.0 * np.outer(sight, sight))
        @ pose.camera_from_body
        @ (eye - 2.0 * np.outer(normal_body, normal_body))
    )
    return Pose(rotation, place - rotation @ middle)
