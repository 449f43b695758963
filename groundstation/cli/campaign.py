"""``groundstation campaign``: fly a scenario many times."""

import os
import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from groundstation.campaign.errors import CampaignError
from groundstation.campaign.plan import Plan, parse_sweep
from groundstation.campaign.running import Means, paths_of, run_campaign
from groundstation.campaign.statistics import passed_of, wilson
from groundstation.cli.number_options import LAST_SEED
from groundstation.cli.run_progress import RunProgress
from groundstation.recording.disk_file import check_new_recording
from groundstation.scenario.loading import load
from groundstation.scenario.running import fly_recorded, longest_s

app = typer.Typer(rich_markup_mode=None)


@app.command()
def campaign(
    file: Annotated[Path, typer.Argument(help="Scenario file (TOML).")],
    runs: Annotated[int, typer.Option(help="How many; of a sweep, for each value.", min=1, max=1_000_000)],
    out: Annotated[Path, typer.Option(help="Folder for runs.csv and report.html.")],
    seed: Annotated[int, typer.Option(help="All runs follow from it.", min=0, max=LAST_SEED)] = 1,
    workers: Annotated[
        int | None, typer.Option(help="Processes; as many as there are cores by default.", min=1, max=1024)
    ] = None,
    scheduler: Annotated[str, typer.Option(help="Of a dask.distributed cluster, tcp://host:port.")] = "",
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the campaign in --out.")] = False,
    only: Annotated[
        int | None,
        typer.Option(help="Fly this run alone, record it, and report on it.", min=0, max=1_000_000),
    ] = None,
    sweep: Annotated[str, typer.Option(help="key=first:last:number: values instead of chance.")] = "",
) -> None:
    """Fly a scenario many times, with values drawn from its dispersions: runs.csv, a row per run.

    Run k of a seed is the same on any machine, and with any number of workers. Ended at any moment, it goes
    on with --resume. Exit code 0 where all runs are there, whatever their verdicts.

    Example: groundstation campaign examples/scenarios/go_to.toml --runs 200 --seed 1 --out campaigns/go_to
    """
    scenario = load(file)
    plan = Plan(runs, seed, parse_sweep(sweep) if sweep else None)
    if only is not None:
        if resume or scheduler:
            raise CampaignError("--only flies one run here and alone: without --resume and --scheduler")
        _fly_one(file, plan, out, only)
        return
    means = Means(workers or os.cpu_count() or 1, scheduler)
    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    try:
        with Progress(*columns, console=Console(stderr=True), disable=not sys.stderr.isatty()) as bar:
            task = bar.add_task("flying", total=plan.count)
            rows = run_campaign(
                scenario,
                plan,
                out,
                means,
                lambda done, total: bar.update(task, completed=done, total=total),
                resume=resume,
            )
    except KeyboardInterrupt:
        sys.stderr.write(f"groundstation: ended by hand; --resume goes on with what {out} holds\n")
        raise typer.Exit(130) from None
    passed = passed_of(rows)
    low, high = wilson(passed, len(rows))
    for path in paths_of(out):
        print(f"campaign: {path}")
    print(f"{passed} of {len(rows)} runs passed (95 % interval {100 * low:.1f} to {100 * high:.1f} %)")


def _fly_one(file: Path, plan: Plan, out: Path, run: int) -> None:
    """Fly a run again, record it and report on it."""
    from groundstation.cli.report import print_report  # what draws, a campaign has not loaded

    if run >= plan.count:
        raise CampaignError(f"--only {run}: the campaign has runs 0 to {plan.count - 1}")
    scenario = load(file)
    varied = scenario.vary(plan.changes(scenario, run))
    recording = out / f"run_{run}.mcap"
    check_new_recording(recording)
    with RunProgress(longest_s(varied)) as progress:
        judged, _ = fly_recorded(varied, plan.laboratory_seed(run), recording, progress)
    print(f"recording: {recording}")
    print_report(recording, out / f"run_{run}", verdict=judged.verdict)
    reason = judged.verdict.reason
    print(f"run {run}: {judged.verdict.verdict}{f': {reason}' if reason else ''}")
