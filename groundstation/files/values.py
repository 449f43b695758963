"""Numbers out of JSON and TOML, refused by the name of their key."""

import math
from collections.abc import Mapping
from typing import Any


def number(values: Mapping[str, Any], key: str, name: str | None = None) -> float:
    """Return a finite number; ``name`` is what messages call it.

    Raises:
        ValueError: It is missing or not one.
    """
    name = name or f"key '{key}'"
    if key not in values:
        raise ValueError(f"{name} is missing")
    if not _is_finite(values[key]):
        raise ValueError(f"{name} must be a finite number, found {values[key]!r}")
    return float(values[key])


def whole_number(values: Mapping[str, Any], key: str) -> int:
    """Return a whole number.

    Raises:
        ValueError: It is missing or not one.
    """
    value = number(values, key)
    if value != int(value):
        raise ValueError(f"key '{key}' must be a whole number, found {value}")
    return int(value)


def numbers(values: Mapping[str, Any], key: str, count: int, name: str | None = None) -> tuple[float, ...]:
    """Return a list of finite numbers; ``name`` is what messages call it.

    Raises:
        ValueError: It is missing or not one of that length.
    """
    name = name or f"key '{key}'"
    if key not in values:
        raise ValueError(f"{name} is missing")
    value = values[key]
    if not isinstance(value, list) or len(value) != count or not all(map(_is_finite, value)):
        raise ValueError(f"{name} must be a list of {count} finite numbers, found {value!r}")
    return tuple(float(item) for item in value)


def _is_finite(value: object) -> bool:
    return not isinstance(value, bool) and isinstance(value, int | float) and math.isfinite(value)
