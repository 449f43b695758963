"""JSON objects."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from drivers.files.trees import parse_json
from groundstation.files.errors import FileError

__all__ = ["json_text", "made_of_json", "parse_json"]

Made = TypeVar("Made")


def made_of_json(data: bytes, path: Path, make: Callable[[dict[str, Any]], Made]) -> Made:
    """Return what is made of the keys of a JSON file.

    Args:
        data: Content of the file.
        path: Its name, for messages.
        make: Raises ValueError where a key is missing or impossible.

    Raises:
        FileError: It is no JSON object, or a key is missing or impossible.
    """
    found = parse_json(data, path)
    try:
        return make(found)
    except ValueError as error:
        raise FileError(f"{path}: {error}.") from error


def json_text(values: dict[str, Any]) -> str:
    """Return an object as it is written to files for people."""
    return json.dumps(values, indent=1) + "\n"
