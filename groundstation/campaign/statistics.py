"""What rows add up to: pass rate with its interval, how often limits held, what drives them. Pure."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import spearmanr

from groundstation.campaign.flying import Row
from groundstation.campaign.plan import Plan, limit_columns
from groundstation.scenario.compiling import groups_of
from groundstation.scenario.limits import expanded
from groundstation.scenario.loading import Scenario
from groundstation.watch.verdict import ERROR, PASSED

Array = NDArray[np.float64]
Z_95 = 1.959963984540054


@dataclass(frozen=True, slots=True, eq=False)
class LimitRuns:
    """One limit of one vehicle, or pair, over all runs.

    Attributes:
        name: ``alpha: position_error_rms_mm``.
        below, above: The limit.
        values: Of each run; NaN where there is none, infinite where it never came.
    """

    name: str
    below: float | None
    above: float | None
    values: Array

    @property
    def held(self) -> NDArray[np.bool_]:
        """Of each run, whether it held."""
        held = np.isfinite(self.values) | np.isinf(self.values)
        if self.below is not None:
            held &= self.values < self.below
        if self.above is not None:
            held &= self.values > self.above
        found: NDArray[np.bool_] = held
        return found

    def overrun(self) -> Array:
        """How far beyond the limit each run is, in units of the limit; 1e9 for what is unknown."""
        out = np.zeros(len(self.values))
        for bound, sign in ((self.below, 1.0), (self.above, -1.0)):
            if bound is not None:
                out = np.maximum(out, sign * (self.values - bound) / max(abs(bound), 1e-9))
        found: Array = np.where(np.isnan(self.values), 1e9, np.minimum(out, 1e9))
        return found


@dataclass(frozen=True, slots=True)
class Driver:
    """How a limit's quantity goes with what was drawn.

    Attributes:
        limit: Which.
        key: What was drawn.
        correlation: Rank correlation (Spearman), -1 to 1.
    """

    limit: LimitRuns
    key: str
    correlation: float


def wilson(passed: int, count: int) -> tuple[float, float]:
    """The 95 % interval of a share (Wilson 1927): right also near 0 and 1.

    Args:
        passed: How many.
        count: Of so many; more than 0.
    """
    share, z2 = passed / count, Z_95**2
    middle = (share + z2 / (2 * count)) / (1 + z2 / count)
    half = Z_95 / (1 + z2 / count) * math.sqrt(share * (1 - share) / count + z2 / (4 * count**2))
    return max(0.0, middle - half), min(1.0, middle + half)


def passed_of(rows: Sequence[Row]) -> int:
    """How many runs passed."""
    return sum(row["verdict"] == PASSED for row in rows)


def errors_of(rows: Sequence[Row]) -> list[Row]:
    """Runs that raised."""
    return [row for row in rows if row["verdict"] == ERROR]


def limits_of(scenario: Scenario, rows: Sequence[Row]) -> list[LimitRuns]:
    """Every limit of every vehicle."""
    groups = groups_of(scenario.rig)
    names = iter(limit_columns(scenario))
    return [
        LimitRuns(f"{'-'.join(vehicles)}: {limit.what}", limit.below, limit.above, numbers(rows, next(names)))
        for number, limit in enumerate(scenario.file.limits)
        for vehicles in expanded(limit, number, groups)
    ]


def numbers(rows: Sequence[Row], column: str) -> Array:
    """A column as numbers; NaN for what is empty or a text."""
    return np.array([_number(row[column]) for row in rows], np.float64)


def _number(cell: str) -> float:
    try:
        return float(cell) if cell else math.nan
    except ValueError:
        return math.nan


def drivers_of(
    scenario: Scenario, plan: Plan, rows: Sequence[Row], limits: Sequence[LimitRuns]
) -> list[Driver]:
    """What goes with what, the strongest first; keys of which only few values are known are left out."""
    found = []
    for key in plan.keys(scenario):
        drawn = numbers(rows, key)
        for limit in limits:
            known = np.isfinite(drawn) & np.isfinite(limit.values)
            if known.sum() < 8 or np.ptp(drawn[known]) == 0.0 or np.ptp(limit.values[known]) == 0.0:
                continue
            correlation = float(spearmanr(drawn[known], limit.values[known]).statistic)
            found.append(Driver(limit, key, correlation))
    return sorted(found, key=lambda driver: -abs(driver.correlation))


def worst_of(rows: Sequence[Row], limits: Sequence[LimitRuns], most: int) -> list[Row]:
    """Runs that did not pass, those farthest beyond their limits first."""
    over = np.zeros(len(rows))
    for limit in limits:
        over = np.maximum(over, limit.overrun())
    order = sorted(range(len(rows)), key=lambda place: -over[place])
    return [rows[place] for place in order if rows[place]["verdict"] != PASSED][:most]
