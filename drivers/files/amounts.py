"""What a number can mean by the unit that its name ends in: beyond it, it is a typo or in another unit."""

from collections.abc import Iterable, Mapping

UNITLESS = 1e10
"""Largest amount of what has no unit: squares and products of such numbers are finite still."""
LEAST = 1e-12
"""Smaller amounts that are not zero are none that anybody has measured; their inverses overflow."""
MOST: Mapping[str, float] = {
    "m": 100.0,
    "mm": 1e5,
    "m_s": 100.0,
    "m_s2": 100.0,
    "s": 1e5,
    "ms": 1e8,
    "hz": 1e6,
    "kg": 1e4,
    "kg_m2": 1e5,
    "n": 1e4,
    "nm": 1e4,
    "n_s": 1e6,
    "n_s_m": 1e4,
    "nm_s": 1e4,
    "pa": 1e9,
    "rad": 10.0,
    "rad_s": 100.0,
    "deg": 3600.0,
    "deg_s": 3600.0,
    "deg_s2": 1e5,
    "c": 1000.0,
    "k": 1000.0,
    "m_s2_k": 10.0,
    "rad_s_k": 10.0,
    "m_s2_rthz": 10.0,
    "rad_s_rthz": 10.0,
    "rad_s_sqrt_s": 10.0,
    "ppm": 1e6,
    "px": 1e5,
}
"""Largest amount by unit, as laboratories of this kind have them, generously."""


def unit_of(name: str) -> str:
    """The unit that a name ends in; empty if it has none."""
    words = name.lower().split("_")
    ends = ("_".join(words[start:]) for start in range(1, len(words)))
    return next((end for end in ends if end in MOST), "")


def fault_of(name: str, number: float) -> str:
    """What is wrong with a number that nobody can mean, by the unit that its name ends in; else empty."""
    unit = unit_of(name)
    most = MOST.get(unit, UNITLESS)
    if not abs(number) <= most:
        return f"is {_shown(number)}, expected at most {most:g} {unit}".rstrip()
    if 0.0 < abs(number) < LEAST:
        return f"is {number:g}, expected 0 or at least {LEAST:g} {unit}".rstrip()
    return ""


def check_amounts(values: Mapping[str, object]) -> None:
    """Refuse a number that nobody can mean; lists and tables are looked into.

    Args:
        values: By name.

    Raises:
        ValueError: It is too large, or next to nothing; the message names the key.
    """
    for name, value in values.items():
        if isinstance(value, Mapping):
            check_amounts(value)
            continue
        for number in _numbers(value):
            fault = fault_of(name, number)
            if fault:
                raise ValueError(f"'{name}' {fault}")


def _numbers(value: object) -> Iterable[float]:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return (value,)
    if isinstance(value, list | tuple):
        return (number for item in value for number in _numbers(item))
    return ()


def _shown(number: float) -> str:
    try:
        return f"{number:g}"
    except OverflowError:
        return "a number of hundreds of digits"
