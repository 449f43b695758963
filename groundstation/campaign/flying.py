"""One run of a campaign, in whatever process: from its number to its row."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from groundstation.campaign.plan import Plan, columns_of, limit_columns
from groundstation.declarations.calls import described, in_one_line
from groundstation.declarations.errors import GroundStationError
from groundstation.rig.read import build_rig, bytes_of, source_of
from groundstation.scenario.loading import Scenario, made
from groundstation.scenario.running import fly
from groundstation.watch.verdict import ERROR

Row = dict[str, str]
"""A row as it is written: every value a text."""


@dataclass(frozen=True)
class Package:
    """A campaign as it travels to workers, which share no disk.

    Attributes:
        token: Equal for equal packages: a worker builds each once.
        path: Of the scenario file.
        content: Keys of it.
        rig_path: Of the rig file.
        rig_content: Keys of it.
        files: Bytes of the files that the rig names.
        plan: Runs and seed.
    """

    token: str
    path: Path
    content: Mapping[str, Any]
    rig_path: Path
    rig_content: Mapping[str, Any]
    files: Mapping[str, bytes]
    plan: Plan

    def __hash__(self) -> int:
        return hash(self.token)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Package) and other.token == self.token


def packed(scenario: Scenario, plan: Plan, token: str) -> Package:
    """A campaign as it travels."""
    source = source_of(scenario.base)
    return Package(
        token, scenario.path, scenario.content, source.path, source.content, bytes_of(scenario.base), plan
    )


@lru_cache(maxsize=2)
def unpacked(package: Package) -> tuple[Scenario, tuple[str, ...]]:
    """The scenario of a package, and the columns of its rows; built once per process."""
    rig = build_rig(dict(package.rig_content), package.rig_path, package.files)
    scenario = made(dict(package.content), package.path, rig)
    return scenario, columns_of(scenario, package.plan)


def fly_run(package: Package, run: int) -> Row:
    """Fly a run; whatever goes wrong is its row's reason."""
    scenario, columns = unpacked(package)
    plan = package.plan
    row = dict.fromkeys(columns, "")
    row |= {"run": str(run), "seed": str(plan.laboratory_seed(run))}
    try:
        changes = plan.changes(scenario, run)
        row |= {key: written(value) for key, value in changes.items()}
        judged = fly(scenario.vary(changes), plan.laboratory_seed(run))
    except GroundStationError as error:
        return row | {"verdict": ERROR, "reason": in_one_line(str(error))}
    except Exception as error:  # of a controller or part of somebody's own: a row, not the end
        return row | {"verdict": ERROR, "reason": described(error)}
    row |= {"verdict": judged.verdict.verdict, "reason": judged.verdict.reason}
    row |= {name: written(value.value) for name, value in judged.values.items() if name in row}
    limits = zip(limit_columns(scenario), judged.verdict.limits, strict=True)
    return row | {column: written(outcome.value) for column, outcome in limits}


def died(columns: tuple[str, ...], plan: Plan, run: int) -> Row:
    """The row of a run that takes its worker with it."""
    row = dict.fromkeys(columns, "")
    reason = "its worker died each time it was flown"
    return row | {
        "run": str(run), "seed": str(plan.laboratory_seed(run)), "verdict": ERROR, "reason": reason,
    }  # fmt: skip


def written(value: float | str | bool) -> str:
    """A value as rows hold it: what is unknown is empty, what never came is ``inf``."""
    if isinstance(value, bool | str):
        return str(value).lower() if isinstance(value, bool) else value
    if isinstance(value, float) and math.isnan(value):
        return ""
    return repr(value) if isinstance(value, int) else f"{value:.9g}"
