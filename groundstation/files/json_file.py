"""JSON objects."""

import json
from typing import Any

from drivers.files.trees import parse_json

__all__ = ["json_text", "parse_json"]


def json_text(values: dict[str, Any]) -> str:
    """Return an object as it is written to files for people."""
    return json.dumps(values, indent=1) + "\n"
