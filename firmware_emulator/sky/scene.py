"""Files of an emulated ceiling and camera, and a sky made of them."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drivers.files.number_tables import load_table
from firmware_emulator.scene_files import CameraFile
from firmware_emulator.sky.optics import CameraOptics
from firmware_emulator.sky.sky import Glow, Sky

_LED_SPREAD = 0.35  # of the logarithm of brightness: LEDs of one batch, driven alike, seen off axis
_GLOWS = 5
_GLOW_RADIUS_M = (0.25, 0.6)
_GLOW_BRIGHTNESS = (1.5, 7.0)


_FARTHEST_M = 100.0  # no ceiling reaches so far: beyond it the list is in millimetres


def read_ceiling(path: Path) -> NDArray[np.float64]:
    """LEDs of a star list (CSV with columns `id,x_m,y_m`), shape (n, 2).

    Raises:
        FileError: The file is missing, or is no star list.
    """
    return load_table(path, ("x_m", "y_m"), ("id",), most=dict.fromkeys(("x_m", "y_m"), _FARTHEST_M)).numbers


def read_camera(path: Path) -> CameraOptics:
    """Optics and mount of a camera file (JSON).

    Raises:
        FileError: The file is missing, or a key is missing or holds something else than its number.
    """
    return CameraFile(path).makes(_optics)


def _optics(file: CameraFile) -> CameraOptics:
    k1, k2, p1, p2, k3 = file.numbers("dist_k1_k2_p1_p2_k3", 5)
    x_m, y_m, _ = file.numbers("mount_offset_body_m", 3)
    return CameraOptics(
        width_px=int(file.number("width")),
        height_px=int(file.number("height")),
        focal_px=(file.number("fx"), file.number("fy")),
        centre_px=(file.number("cx"), file.number("cy")),
        distortion=(k1, k2, p1, p2, k3),
        ceiling_height_m=file.number("ceiling_height_above_camera_m"),
        offset_body_m=(x_m, y_m),
        yaw_rad=file.number("mount_yaw_rad"),
        tilt_x_rad=file.number("mount_tilt_x_rad"),
        tilt_y_rad=file.number("mount_tilt_y_rad"),
    )


def build_sky(ceiling_xy_m: NDArray[np.float64], seed: np.random.SeedSequence) -> Sky:
    """A sky with LEDs of uneven brightness and a few soft glows, all decided by the seed.

    The glows make the background uneven by the amounts of the star tracker's sample frames.
    """
    rng = np.random.default_rng(seed)
    brightness = np.exp(_LED_SPREAD * rng.standard_normal(len(ceiling_xy_m)))
    low, high = ceiling_xy_m.min(axis=0), ceiling_xy_m.max(axis=0)
    middles_m = rng.uniform(low, high, (_GLOWS, 2)).tolist()
    glows = [
        Glow(x_m, y_m, rng.uniform(*_GLOW_RADIUS_M), rng.uniform(*_GLOW_BRIGHTNESS)) for x_m, y_m in middles_m
    ]
    return Sky(ceiling_xy_m, brightness, rng, glows)
