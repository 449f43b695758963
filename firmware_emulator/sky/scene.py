"""Files of an emulated ceiling and camera, and a sky made of them."""

import csv
import json
import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from firmware_emulator.sky.optics import CameraOptics
from firmware_emulator.sky.sky import Glow, Sky

_LED_SPREAD = 0.35  # of the logarithm of brightness: LEDs of one batch, driven alike, seen off axis
_GLOWS = 5
_GLOW_RADIUS_M = (0.25, 0.6)
_GLOW_BRIGHTNESS = (1.5, 7.0)


class SceneError(ValueError):
    """A star list or camera file cannot be used; the message names file, place and what was expected."""


def read_ceiling(path: Path) -> NDArray[np.float64]:
    """LEDs of a star list (CSV with columns `id,x_m,y_m`), shape (n, 2).

    Raises:
        SceneError: The file is missing, or is no star list.
    """
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = csv.DictReader(file)
            missing = {"id", "x_m", "y_m"} - set(rows.fieldnames or ())
            if missing:
                raise SceneError(f"{path}: the star list has no column {', '.join(sorted(missing))}")
            places = [_place(path, rows.line_num, row) for row in rows]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise SceneError(f"{path}: cannot read the star list: {error}") from error
    if not places:
        raise SceneError(f"{path}: the star list holds no LED")
    return np.array(places)


def read_camera(path: Path) -> CameraOptics:
    """Optics and mount of a camera file (JSON).

    Raises:
        SceneError: The file is missing, or a key is missing or holds something else than its number.
    """
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise SceneError(f"{path}: cannot read the camera file: {error}") from error
    if not isinstance(data, dict):
        raise SceneError(f"{path}: a camera file is a JSON object, found {type(data).__name__}")

    def numbers(key: str, count: int) -> tuple[float, ...]:
        found = data.get(key)
        values = found if isinstance(found, list) else [found]
        if len(values) != count or not all(
            isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
            for value in values
        ):
            wanted = "a finite number" if count == 1 else f"a list of {count} finite numbers"
            raise SceneError(f"{path}: key {key!r} must be {wanted}, found {found!r}")
        return tuple(map(float, values))

    def number(key: str) -> float:
        return numbers(key, 1)[0]

    k1, k2, p1, p2, k3 = numbers("dist_k1_k2_p1_p2_k3", 5)
    offset = numbers("mount_offset_body_m", 3)
    try:
        return CameraOptics(
            width_px=int(number("width")),
            height_px=int(number("height")),
            focal_px=(number("fx"), number("fy")),
            centre_px=(number("cx"), number("cy")),
            distortion=(k1, k2, p1, p2, k3),
            ceiling_height_m=number("ceiling_height_above_camera_m"),
            offset_body_m=(offset[0], offset[1]),
            yaw_rad=number("mount_yaw_rad"),
            tilt_x_rad=number("mount_tilt_x_rad"),
            tilt_y_rad=number("mount_tilt_y_rad"),
        )
    except SceneError:
        raise
    except ValueError as error:
        raise SceneError(f"{path}: {error}") from error


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


def _place(path: Path, line: int, row: dict[str, str]) -> tuple[float, float]:
    try:
        x_m, y_m = float(row["x_m"]), float(row["y_m"])
    except (TypeError, ValueError) as error:
        raise SceneError(f"{path}, line {line}: x_m and y_m must be numbers") from error
    if not (math.isfinite(x_m) and math.isfinite(y_m)):
        raise SceneError(f"{path}, line {line}: x_m and y_m must be finite, found {x_m} and {y_m}")
    return x_m, y_m
