"""Rows with numbers judged against a must, with the aim printed beside it."""

import operator
from collections.abc import Callable, Sequence

from bench.rows import Row

Numbers = float | Sequence[float]


def at_most(
    what: str, found: Numbers, must: Numbers, aim: Numbers = (), unit: str = "", note: str = ""
) -> Row:
    """A row that is kept if no number is above its must.

    Args:
        what: What is measured.
        found: One number, or several that belong together; NaN keeps no limit.
        must: As many.
        aim: As many, or none.
        unit: Of all of them.
        note: Said after the figures: units of work, counts.
    """
    return _judged(what, found, must, aim, unit, note, operator.le)


def at_least(
    what: str, found: Numbers, must: Numbers, aim: Numbers = (), unit: str = "", note: str = ""
) -> Row:
    """A row that is kept if no number is below its must."""
    row = _judged(what, found, must, aim, unit, note, operator.ge)
    return Row(row.what, f"at least {row.limit}", row.measured, row.ok)


def between(
    what: str, found: Numbers, low: Numbers, high: Numbers, aim: str = "", unit: str = "", note: str = ""
) -> Row:
    """A row that is kept if every number is inside its bounds; the aim as it is to be printed."""
    numbers, lows, highs = _tuple(found), _tuple(low), _tuple(high)
    bounds = " / ".join(f"{a:.3g}-{b:.3g}" for a, b in zip(lows, highs, strict=True))
    ok = all(a <= x <= b for a, x, b in zip(lows, numbers, highs, strict=True))
    limit = _with_unit(bounds, unit) + (f", aim {aim}" if aim else "")
    return Row(what, limit, _measured(numbers, unit, note), ok)


def plain(what: str, found: Numbers, unit: str = "", note: str = "") -> Row:
    """A row without a limit."""
    return Row(what, "", _measured(_tuple(found), unit, note), None)


def _judged(
    what: str,
    found: Numbers,
    must: Numbers,
    aim: Numbers,
    unit: str,
    note: str,
    is_kept: Callable[[float, float], bool],
) -> Row:
    numbers, musts, aims = _tuple(found), _tuple(must), _tuple(aim)
    if aims and len(aims) != len(musts):
        raise ValueError(f"{what}: {len(aims)} aims for {len(musts)} limits")
    limit = _with_unit(" / ".join(f"{x:g}" for x in musts), unit)
    if aims:
        limit += f", aim {' / '.join(f'{x:g}' for x in aims)}"
    ok = all(is_kept(x, y) for x, y in zip(numbers, musts, strict=True))
    return Row(what, limit, _measured(numbers, unit, note), ok)


def _measured(numbers: tuple[float, ...], unit: str, note: str) -> str:
    figures = _with_unit(" / ".join(short(x) for x in numbers), unit)
    return f"{figures} ({note})" if note else figures


def short(number: float) -> str:
    """Three digits that count, never in powers of ten; whole numbers whole."""
    if number.is_integer():
        return f"{number:.0f}"
    text = f"{number:.3g}"
    return f"{number:.0f}" if "e" in text and abs(number) > 1.0 else text


def _with_unit(text: str, unit: str) -> str:
    return f"{text} {unit}" if unit else text


def _tuple(numbers: Numbers) -> tuple[float, ...]:
    return tuple(map(float, numbers)) if isinstance(numbers, Sequence) else (float(numbers),)
