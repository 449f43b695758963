"""Two runs beside each other: their figures in words, and how far apart the vehicles flew."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from groundstation.declarations.tables import Tables
from groundstation.watch.flown_run import FlownRun, read_run
from groundstation.watch.page.plan import trail
from groundstation.watch.tracks import Array

_STEP_S = 0.1


class Figure(NamedTuple):
    """One figure of both runs.

    Attributes:
        vehicle: Whose.
        what: Its name, with the unit.
        first: Of the first run; NaN where it has none.
        second: Of the second run; NaN where it has none.
    """

    vehicle: str
    what: str
    first: float
    second: float

    @property
    def change(self) -> str:
        """How the second differs from the first, for people."""
        if math.isnan(self.first) or math.isnan(self.second):
            return ""
        if self.first == self.second:
            return "equal"
        if self.first == 0.0:
            return f"{self.second - self.first:+.3g}"
        return f"{100.0 * (self.second / self.first - 1.0):+.1f} %"


class Apart(NamedTuple):
    """How far a vehicle was from its place in the other run, since the last vehicle of each flew."""

    vehicle: str
    seconds: float
    rms_mm: float
    most_mm: float
    most_at_s: float

    def sentence(self) -> str:
        """For people."""
        return (
            f"{self.vehicle}: over {self.seconds:.1f} s of flight the trails are {self.rms_mm:.1f} mm apart "
            f"(root mean square), at most {self.most_mm:.1f} mm at {self.most_at_s:.1f} s"
        )


class Comparison(NamedTuple):
    """Two runs: what they are called, figures, distances."""

    first: FlownRun
    second: FlownRun
    figures: list[Figure]
    apart: list[Apart]


def compare_runs(first: Path, second: Path, tables: Tables) -> Comparison:
    """Read two recordings, or folders of runs.

    Raises:
        UsageError: One holds no vehicle's state.
        RecordingError: One cannot be read.
    """
    runs = read_run(first, tables), read_run(second, tables)
    return Comparison(
        *runs, list(_figures(*runs)), [found for name in _both(*runs) if (found := _apart(*runs, name))]
    )


def _both(first: FlownRun, second: FlownRun) -> list[str]:
    return [name for name in first.vehicles if name in second.vehicles]


def _figures(first: FlownRun, second: FlownRun) -> Iterator[Figure]:
    for vehicle in dict.fromkeys([*first.vehicles, *second.vehicles]):
        ours = _flat(first.numbers(vehicle)) if vehicle in first.vehicles else {}
        theirs = _flat(second.numbers(vehicle)) if vehicle in second.vehicles else {}
        for what in dict.fromkeys([*ours, *theirs]):
            values = ours.get(what, math.nan), theirs.get(what, math.nan)
            if not all(map(math.isnan, values)):
                yield Figure(vehicle, what, *values)


def _flat(numbers: dict[str, Any], within: str = "") -> dict[str, float]:
    """Numbers and those inside of tables, by names with dots."""
    found: dict[str, float] = {}
    for key, value in numbers.items():
        if isinstance(value, dict):
            found |= _flat(value, f"{within}{key}.")
        elif isinstance(value, bool | int | float):
            found[f"{within}{key}"] = float(value)
    return found


def _apart(first: FlownRun, second: FlownRun, vehicle: str) -> Apart | None:
    """Both trails at equal times since the last vehicle of each run flew, or since its beginning."""
    rows = [_counted(run, trail(run.vehicles[vehicle].track)) for run in (first, second)]
    begin_s = max(0.0, *(each[0, 0] for each in rows))
    end_s = min(each[-1, 0] for each in rows)
    if end_s - begin_s < _STEP_S:
        return None
    t_s = np.arange(begin_s, end_s, _STEP_S)
    x, y = (
        np.interp(t_s, rows[0][:, 0], rows[0][:, k]) - np.interp(t_s, rows[1][:, 0], rows[1][:, k])
        for k in (1, 2)
    )
    apart_mm = 1e3 * np.hypot(x, y)
    worst = int(np.argmax(apart_mm))
    rms_mm = float(np.sqrt(np.mean(apart_mm**2)))
    return Apart(vehicle, float(end_s - begin_s), rms_mm, float(apart_mm[worst]), float(t_s[worst]))


def _counted(run: FlownRun, rows: Array) -> Array:
    zero_s = 0.0 if math.isnan(run.aloft_s) else run.aloft_s
    return np.column_stack([rows[:, 0] - zero_s, rows[:, 1:3]])
