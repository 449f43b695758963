"""`groundstation relative tle`: where two objects of the NORAD catalogue are beside each other."""

from __future__ import annotations

import math
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from groundstation.declarations.errors import UsageError
from groundstation.files.errors import FileError
from groundstation.files.number_tables import csv_text
from groundstation.files.reading import read_bytes, text_of
from groundstation.files.writing import check_targets, write_files
from groundstation.relative_navigation.two_line_elements import (
    ACCURACY,
    LIMITS,
    RelativeState,
    TwoLineElements,
    moments,
    parse_elements,
    relative_state,
)

COLUMNS = (
    "utc", "minutes", "x_m", "y_m", "z_m", "vx_m_s", "vy_m_s", "vz_m_s", "distance_m", "rate_rad_s",
    "c1_m", "c2_m", "c3_m", "c4_m", "c5_m", "c6_m",
)  # fmt: skip


def tle(
    file: Annotated[Path, typer.Argument(help="Element sets: of both objects, or of the first.")],
    out: Annotated[Path, typer.Option(help="CSV to write, a row per moment.")],
    file2: Annotated[Path | None, typer.Argument(help="Element set of the second object.")] = None,
    at: Annotated[
        str | None, typer.Option(help="UTC, as 2012-01-25T02:18:00; without it the later epoch.")
    ] = None,
    minutes: Annotated[str, typer.Option(help="Moments from --at on: FIRST:LAST:STEP in minutes.")] = "0:0:1",
) -> None:
    """Find the second object as seen from the first, from two-line elements by SGP4: kilometres, no better.

    Axes of the first object: x radial up, y along-track, z along the orbit's normal; velocities are those
    seen in these axes, which turn; c1_m to c6_m are the constants of Hill's equations that begin there, nan
    where distances are not small beside the orbit's radius, or the orbit is far from circular.

    Example: groundstation relative tle two.txt --at 2012-01-25T02:18:00 --minutes 0:90:1 --out relative.csv

    Example: groundstation relative tle progress.txt chibis.txt --out relative.csv
    """
    check_targets(out, sources=[file, file2])
    first, second = _pair(file, file2)
    start = max(first.epoch, second.epoch) if at is None else _moment(at)
    try:
        when = moments(start, _minutes(minutes))
    except ValueError as error:
        raise UsageError(f"--minutes is {minutes!r}: {error}.") from error
    try:
        states = [relative_state(first, second, each) for each in when]
    except ValueError as error:
        raise UsageError(f"{error}.") from error
    write_files({out: csv_text(COLUMNS, [_row(state, start) for state in states])})
    _report(first, second, states)


def _pair(file: Path, file2: Path | None) -> tuple[TwoLineElements, TwoLineElements]:
    found = _read(file)
    if file2 is None:
        if len(found) != 2:
            names = f" ({', '.join(each.name for each in found)})" if found else ""
            raise FileError(
                f"{file}: holds {len(found)} element sets{names}, expected 2: leave those of the two objects "
                "in it, or give a file for each."
            )
        return found[0], found[1]
    other = _read(file2)
    for path, sets in ((file, found), (file2, other)):
        if len(sets) != 1:
            raise FileError(f"{path}: holds {len(sets)} element sets, expected 1 in each of two files.")
    return found[0], other[0]


def _read(path: Path) -> list[TwoLineElements]:
    text = text_of(read_bytes(path), path)
    try:
        return parse_elements(text)
    except ValueError as error:
        raise FileError(f"{path}: {error}.") from error


def _moment(text: str) -> datetime:
    try:
        found = datetime.fromisoformat(text)
        return found.replace(tzinfo=UTC) if found.tzinfo is None else found.astimezone(UTC)
    except (ValueError, OverflowError) as error:
        raise UsageError(f"--at must be a moment such as 2012-01-25T02:18:00, found {text!r}.") from error


def _minutes(text: str) -> tuple[float, float, float]:
    parts = text.split(":")
    if len(parts) != 3:
        raise ValueError("expected three numbers FIRST:LAST:STEP")
    first, last, step = (_number(part) for part in parts)
    return first, last, step


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise ValueError(f"expected three numbers FIRST:LAST:STEP, found {text!r}") from error


def _row(state: RelativeState, start: datetime) -> tuple[str, ...]:
    c = state.constants
    numbers = (
        (state.when - start).total_seconds() / 60.0,
        *state.position_m,
        *state.velocity_m_s,
        float(np.linalg.norm(state.position_m)),
        state.rate_rad_s,
        *((math.nan,) * 6 if c is None else (c.c1, c.c2, c.c3, c.c4, c.c5, c.c6)),
    )
    return (f"{state.when:%Y-%m-%dT%H:%M:%S.%f}Z", *(f"{x + 0.0:.10g}" for x in numbers))


def _report(first: TwoLineElements, second: TwoLineElements, states: list[RelativeState]) -> None:
    state = states[0]
    for what, each in (("first", first), ("second", second)):
        model = "deep space" if each.is_deep_space else "near Earth"
        print(
            f"{what} {each.name}: epoch {each.epoch:%Y-%m-%dT%H:%M:%S.%f}Z, a = "
            f"{1e-3 * each.semi_major_axis_m:.1f} km, period {each.period_s:.1f} s, {model}"
        )
        for note in each.notes:
            print(f"  {note}")
    if first.number == second.number:
        print(f"both sets are of object {first.number}")
    x, y, z = (1e-3 * state.position_m + 0.0).tolist()
    print(f"{state.when:%Y-%m-%dT%H:%M:%SZ}: up {x:.3f} km, along-track {y:.3f} km, normal {z:.3f} km")
    constants = state.constants
    if constants is not None:
        axes = ", ".join(f"{axis:.4g}" for axis in constants.semi_axes_m)
        print(
            f"C1 = {constants.c1:.4g} m: the ellipse wanders {constants.drift_m_rev + 0.0:.4g} m a "
            f"revolution; half axes {axes} m (up, along-track, normal)"
        )
    without = sum(each.constants is None for each in states)
    if without:
        print(
            f"c1_m to c6_m are nan at {without} of {len(states)} moments: Hill's equations do not hold "
            f"there. {LIMITS}"
        )
    print(ACCURACY)
