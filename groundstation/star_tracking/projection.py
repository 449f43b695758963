"""Where stars of the ceiling fall in a picture."""

import numpy as np
from numpy.typing import NDArray

from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.rays import distort

Array = NDArray[np.float64]


def project(camera: CameraCalibration, pose: Array, star_m: Array) -> tuple[Array, Array]:
    """Give pixels (m, 2) of stars (m, 2) seen from poses (m, 3), and d pixel / d flat (m, 2, 2).

    ``flat`` is the star relative to the body origin in body axes.
    """
    flat = seen_from_body(pose, star_m)
    rotation = camera.body_from_camera()
    height = camera.ceiling_height_above_camera_m
    ray = np.column_stack((flat - np.asarray(camera.mount_offset_body_m[:2]), np.full(len(flat), height)))
    seen = ray @ rotation
    x, y = seen[:, 0] / seen[:, 2], seen[:, 1] / seen[:, 2]
    u, v, d = distort(camera, x, y)
    by_flat = rotation[:2].T  # d seen / d flat, (3, 2)
    normal = (by_flat[None, :2] - np.stack((x, y), axis=1)[:, :, None] * by_flat[None, 2:]) / seen[
        :, 2, None, None
    ]
    scale = np.array([camera.fx, camera.fy])
    pixel = np.stack((camera.cx + camera.fx * u, camera.cy + camera.fy * v), axis=1)
    return pixel, scale[None, :, None] * (d @ normal)


def seen_from_body(pose: Array, star_m: Array) -> Array:
    """Give stars (m, 2) relative to the body origins of poses (m, 3), in body axes."""
    c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
    dx, dy = star_m[:, 0] - pose[:, 0], star_m[:, 1] - pose[:, 1]
    return np.stack((c * dx + s * dy, -s * dx + c * dy), axis=1)
