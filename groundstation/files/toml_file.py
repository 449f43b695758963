"""TOML: read, and written as numbers with unit and sigma, tables, strings."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any, TypeVar

from drivers.files.trees import parse_toml, toml_of
from groundstation.files.errors import FileError

__all__ = ["made_of_tables", "parse_toml", "toml_lines", "toml_of", "toml_table", "toml_value"]

Made = TypeVar("Made")
Scalar = float | int | str | bool | datetime
Value = Scalar | Sequence["Value"]


def made_of_tables(data: bytes, path: Path, make: Callable[[dict[str, Any]], Made]) -> Made:
    """Return what is made of a TOML file that has a table for each mock-up.

    Args:
        data: Content of the file.
        path: Its name, for messages.
        make: Raises ValueError where a table or key is missing or impossible.

    Raises:
        FileError: It is no TOML, has no table, or a key is missing or impossible.
    """
    found = parse_toml(data, path)
    if not found:
        raise FileError(f"{path}: names no mock-up; expected a table like [alpha].")
    try:
        return make(found)
    except ValueError as error:
        raise FileError(f"{path}: {error}.") from error


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
