"""Numbers out of JSON and TOML, refused by the name of their key."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

_MOST_SHOWN = 80


def number(values: Mapping[str, Any], key: str, name: str | None = None) -> float:
    """Return a finite number; ``name`` is what messages call it.

    Raises:
        ValueError: It is missing or not one.
    """
    name = name or f"key '{key}'"
    if key not in values:
        raise ValueError(f"{name} is missing")
    if not _is_finite(values[key]):
        raise ValueError(f"{name} must be a finite number, found {_shown(values[key])}")
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
        raise ValueError(f"{name} must be a list of {count} finite numbers, found {_shown(value)}")
    return tuple(float(item) for item in value)


def check_keys(values: Mapping[str, Any], where: str, keys: Sequence[str]) -> None:
    """Refuse keys that nobody reads.

    Args:
        values: A table.
        where: What messages call it.
        keys: Those that are read.

    Raises:
        ValueError: It has another one.
    """
    unknown = set(values) - set(keys)
    if unknown:
        raise ValueError(f"'{where}.{min(unknown)}' is no known key (a typo?)")


def check_amount(name: str, value: float, most: float, hint: str = "") -> None:
    """Refuse a number that nobody can mean.

    Args:
        name: What messages call it.
        value: The number.
        most: Its largest amount.
        hint: What may be wrong.

    Raises:
        ValueError: It is larger.
    """
    if not abs(value) <= most:
        raise ValueError(f"{name} is {value:g}, expected at most {most:g}{f' ({hint})' if hint else ''}")


def _is_finite(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number of hundreds of digits
        return False


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= _MOST_SHOWN else f"{text[: _MOST_SHOWN - 3]}..."
