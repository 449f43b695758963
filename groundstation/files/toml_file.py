"""TOML: read, and written as numbers with unit and sigma, tables, strings."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from datetime import datetime

from drivers.files.trees import parse_toml, toml_of

__all__ = ["parse_toml", "toml_lines", "toml_of", "toml_table", "toml_value"]

Scalar = float | int | str | bool | datetime
Value = Scalar | Sequence["Value"]


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
