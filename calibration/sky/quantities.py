"""Calibrated values of a camera by name, with unit and one sigma."""

import math
from collections.abc import Mapping

from calibration.result import Quantity
from groundstation.star_tracking.camera_model import CameraCalibration

LENS_NAMES = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
UNITS = {
    **dict.fromkeys(("fx", "fy", "cx", "cy"), "px"),
    **dict.fromkeys(("k1", "k2", "p1", "p2", "k3"), "1"),
    **dict.fromkeys(("mount_offset_x_m", "mount_offset_y_m", "ceiling_height_above_camera_m"), "m"),
    **dict.fromkeys(("mount_tilt_x_rad", "mount_tilt_y_rad", "mount_yaw_rad"), "rad"),
}


def camera_quantities(camera: CameraCalibration, sigmas: Mapping[str, float]) -> dict[str, Quantity]:
    """The values of a camera that have a standard deviation; with the mount's offset also its yaw."""
    mapping = camera.to_mapping()
    mapping.update(zip(("k1", "k2", "p1", "p2", "k3"), camera.distortion, strict=True))
    mapping["mount_offset_x_m"], mapping["mount_offset_y_m"], _ = camera.mount_offset_body_m
    found = {name: Quantity(float(mapping[name]), sigma, UNITS[name]) for name, sigma in sigmas.items()}
    if "mount_offset_x_m" in found:
        found["mount_yaw_rad"] = Quantity(camera.mount_yaw_rad, math.nan, "rad")
    return found
