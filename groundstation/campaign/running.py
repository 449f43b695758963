"""A campaign from its plan to its report: what is missing is flown, each run a row on disk."""

import hashlib
import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from groundstation.campaign.cluster import fly_there
from groundstation.campaign.errors import CampaignError
from groundstation.campaign.flying import Row, packed
from groundstation.campaign.known_rows import row_check
from groundstation.campaign.local import fly_here
from groundstation.campaign.page import render_page
from groundstation.campaign.parquet import write_parquet
from groundstation.campaign.plan import MOST_RUNS, Plan, columns_of, identity
from groundstation.campaign.rows import CSV, Rows
from groundstation.files.writing import write_file
from groundstation.recording.software import software
from groundstation.scenario.dispersions import SEED
from groundstation.scenario.loading import Scenario
from groundstation.scenario.rehearsal import (
    check_dispersions,
    check_extremes,
    check_failures,
    check_varied,
)

Progress = Callable[[int, int], None]
REPORT = "report.html"


@dataclass(frozen=True, slots=True)
class Means:
    """What flies a campaign.

    Attributes:
        workers: Processes of this machine.
        scheduler: Address of a cluster that flies instead; empty for none.
    """

    workers: int
    scheduler: str = ""


def check(scenario: Scenario, plan: Plan) -> None:
    """What can be known before anything flies.

    Raises:
        UsageError: Rig or laboratory refuse what may be drawn, or the first and last values of a sweep.
    """
    check_failures(scenario)
    check_dispersions(scenario)
    check_extremes(scenario)
    if plan.sweep is not None and plan.sweep.key == SEED:
        raise CampaignError(f"--sweep {SEED}: each run has a seed of its own, drawn from --seed")
    if plan.count > MOST_RUNS:
        raise CampaignError(f"{plan.count} runs are too many: a campaign has {MOST_RUNS} at most")
    if plan.sweep is not None:
        for run in (0, plan.count - 1):
            value = plan.sweep.values[run // plan.runs]
            check_varied(scenario, plan.changes(scenario, run), f"--sweep {plan.sweep.key} = {value:g}")


def run_campaign(
    scenario: Scenario, plan: Plan, folder: Path, means: Means, progress: Progress, *, resume: bool
) -> list[Row]:
    """Fly what a folder lacks, and write its report; return all rows.

    Args:
        scenario: What is flown.
        plan: How often, and from which seed.
        folder: For ``runs.csv``, ``report.html``, and ``runs.parquet`` where pyarrow is installed.
        means: Who flies.
        progress: Called with the number of rows there, and of all.
        resume: Whether a campaign that is there is continued.

    Raises:
        UsageError: It cannot be begun or continued so.
    """
    check(scenario, plan)
    stated = identity(scenario, plan)
    columns = columns_of(scenario, plan)
    token = hashlib.sha256(json.dumps(stated, sort_keys=True, default=str).encode()).hexdigest()[:16]
    package = packed(scenario, plan, f"{token}-{time.time_ns()}")
    with Rows(folder, columns, stated, resume=resume, is_right=row_check(scenario, plan)) as rows:
        done = rows.done
        if any(run >= plan.count for run in done):
            raise CampaignError(f"{folder} holds {max(done) + 1} runs already, --runs asks for {plan.count}")
        missing = [run for run in range(plan.count) if run not in done]
        count = len(done)

        def take(run: int, row: Row) -> None:
            nonlocal count
            rows.add(run, row)
            count += 1
            progress(count, plan.count)

        progress(count, plan.count)
        if means.scheduler:
            fly_there(package, missing, means.scheduler, take)
        else:
            fly_here(package, missing, means.workers, take)
        found = rows.read()
    write_parquet(folder, columns, found)
    write_file(folder / REPORT, render_page(scenario, plan, found, software()))
    return found


def paths_of(folder: Path) -> list[Path]:
    """What a campaign has left, for people."""
    names = (CSV, "runs.parquet", REPORT)
    return [folder / name for name in names if (folder / name).exists()]
