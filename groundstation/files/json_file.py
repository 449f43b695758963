"""A JSON object from a file, refused in one sentence."""

import json
from pathlib import Path
from typing import Any

from groundstation.files.errors import CalibrationFileError


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
