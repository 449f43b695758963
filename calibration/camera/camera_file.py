"""What the files of all cameras share: a JSON object, and axes turned by a yaw and two tilts."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from calibration.camera.errors import CalibrationFileError


def read_camera_file(path: Path) -> dict[str, Any]:
    """Read the JSON object of a camera.

    Raises:
        CalibrationFileError: The file is missing, no text, no JSON or no object.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise CalibrationFileError(f"{path}: cannot be read ({error.strerror or error}).") from error
    except UnicodeDecodeError as error:
        raise CalibrationFileError(f"{path}: is not a text file.") from error
    try:
        data = json.loads(text)
    except json.JSONDecodeError as error:
        raise CalibrationFileError(f"{path}: line {error.lineno} is no JSON ({error.msg}).") from error
    if not isinstance(data, dict):
        raise CalibrationFileError(f"{path}: expected a JSON object with the camera's keys.")
    return data


def turned_axes(yaw_rad: float, tilt_x_rad: float, tilt_y_rad: float) -> NDArray[np.float64]:
    """``Rz(yaw) Rx(tilt_x) Ry(tilt_y)``, shape (3, 3)."""
    cz, sz = math.cos(yaw_rad), math.sin(yaw_rad)
    cx, sx = math.cos(tilt_x_rad), math.sin(tilt_x_rad)
    cy, sy = math.cos(tilt_y_rad), math.sin(tilt_y_rad)
    about_z = np.array([[cz, -sz, 0.0], [sz, cz, 0.0], [0.0, 0.0, 1.0]])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cx, -sx], [0.0, sx, cx]])
    about_y = np.array([[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]])
    return np.asarray(about_z @ about_x @ about_y)
