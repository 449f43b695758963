"""TOML: read, and written as numbers with unit and sigma, tables, strings."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

from groundstation.files.errors import FileError
from groundstation.files.reading import text_of

Scalar = float | int | str | bool | datetime
Value = Scalar | Sequence["Value"]


def parse_toml(data: bytes, path: Path) -> dict[str, Any]:
    """Read a TOML file.

    Raises:
        FileError: It is no text or no TOML.
    """
    try:
        return tomllib.loads(text_of(data, path))
    except tomllib.TOMLDecodeError as error:
        raise FileError(f"{path}: is not valid TOML: {error}.") from error


def toml_value(value: Value) -> str:
    """Return a value as TOML writes it; floats with nine digits."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        if math.isnan(value):
            return "nan"
        if math.isinf(value):
            return "inf" if value > 0.0 else "-inf"
        return repr(float(f"{value:.9g}"))
    if isinstance(value, datetime):
        return value.isoformat(timespec="seconds")
    if isinstance(value, str):
        escaped = value.replace("\\", "\\\\").replace('"', '\\"').replace("\n", " ").replace("\t", " ")
        return f'"{escaped}"'
    return "[" + ", ".join(toml_value(item) for item in value) + "]"


def toml_lines(values: Mapping[str, Value]) -> list[str]:
    """Return `key = value` lines."""
    return [f"{key} = {toml_value(value)}" for key, value in values.items()]


def toml_table(name: str, values: Mapping[str, Value], *, is_row: bool = False) -> list[str]:
    """Return a table with its heading, `[[name]]` for a row of an array of tables."""
    return ["", f"[[{name}]]" if is_row else f"[{name}]", *toml_lines(values)]
