"""JSON objects."""

import json
from pathlib import Path
from typing import Any

from groundstation.files.errors import FileError
from groundstation.files.reading import text_of


def parse_json(data: bytes, path: Path) -> dict[str, Any]:
    """Read a file that holds one JSON object.

    Raises:
        FileError: It is no text, no JSON or no object.
    """
    try:
        found = json.loads(text_of(data, path))
    except json.JSONDecodeError as error:
        raise FileError(
            f"{path}: line {error.lineno}, column {error.colno} is no JSON ({error.msg})."
        ) from error
    if not isinstance(found, dict):
        raise FileError(f"{path}: expected a JSON object, found {type(found).__name__}.")
    return found


def json_text(values: dict[str, Any]) -> str:
    """Return an object as it is written to files for people."""
    return json.dumps(values, indent=1) + "\n"
