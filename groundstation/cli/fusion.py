"""`groundstation fusion`: state estimates from packets and late star fixes in files."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from groundstation.cli.plot_option import Plot
from groundstation.cli.progress import progress_line
from groundstation.data_sets.fusion_folder import read_folder
from groundstation.data_sets.inputs import inputs_of
from groundstation.declarations.errors import UsageError
from groundstation.files.amounts import UNITLESS
from groundstation.files.png import png_of
from groundstation.files.writing import Content, check_targets, write_files
from groundstation.fusion.disagreement import likely_cause, why_nothing
from groundstation.fusion.error_state_filter import ErrorStateFilter
from groundstation.fusion.estimate_figure import draw_estimate
from groundstation.fusion.estimator import Estimator, FixOutcome, PlanarState
from groundstation.fusion.estimators import ESTIMATORS, PUBLISHED
from groundstation.fusion.flight_data import FlightData, estimate, lost_spans
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.offline import OfflineSmoother
from groundstation.fusion.published_settings import AS_PUBLISHED, PublishedMotion
from groundstation.fusion.slope_grid import noise_with, slope_grid
from groundstation.fusion.table_map import TableMap

app = typer.Typer(no_args_is_help=True, add_completion=False, rich_markup_mode=None)

NS = 1e9
ESTIMATE_HEADER = (
    "t_s,x_m,y_m,heading_rad,vx_m_s,vy_m_s,omega_rad_s,bias_omega,bias_ax,bias_ay,"
    "std_x_m,std_y_m,std_heading_rad\n"
)
FIXES_HEADER = "t_exposure_s,used,reason,innovation_x_m,innovation_y_m,innovation_heading_rad,nis\n"


@app.callback()
def _root() -> None:
    """State of a mock-up from its IMU and late star fixes.

    Example: groundstation fusion run try/flight --out estimate.csv
    """


@app.command()
def run(
    folder: Annotated[Path, typer.Argument(help="Folder with imu.csv, stars.csv and meta.json.")],
    out: Annotated[Path, typer.Option(help="CSV to write, a row per packet; fixes.csv goes beside it.")],
    method: Annotated[str, typer.Option(help=f"One of: {', '.join(ESTIMATORS)}.")] = "filter",
    table_map: Annotated[
        Path | None, typer.Option(help="Map of the table's slope, made by `calibrate table-map`.")
    ] = None,
    smooth: Annotated[bool, typer.Option("--smooth", help="Look ahead as well: for recordings.")] = False,
    gate_both: Annotated[
        bool,
        typer.Option(
            "--gate-both",
            help="Published methods: a sample is left out only if accelerations and rate are beyond their "
            "limits; else one of them is enough.",
        ),
    ] = False,
    median_zeros: Annotated[
        bool, typer.Option("--median-zeros", help="Our addition to them: the rest's median, not its mean.")
    ] = False,
    exact_steps: Annotated[
        bool,
        typer.Option("--exact-steps", help="Our addition to them: a/2 d^2 instead of the printed 3/2 a d^2."),
    ] = False,
    fill_gated: Annotated[
        bool,
        typer.Option(
            "--fill-gated", help="Our addition to them: the last good sample for one that is left out."
        ),
    ] = False,
    fit_after: Annotated[
        float | None,
        typer.Option(help="Our addition to them: constant offsets fitted in the loop after so many seconds."),
    ] = None,
    plot: Plot = None,
) -> None:
    """Estimate the motion in a data set; causal, as if it were live, unless --smooth.

    reintegration, stars and imu are the published methods as published: means of the rest as zeros, the
    printed integration, from each late fix the stored samples again; no test of fixes, no offsets fitted.

    Example: groundstation fusion run try/flight --out estimate.csv

    Example: groundstation fusion run try/flight --out estimate.csv --method imu --plot estimate.png
    """
    if out.name == "fixes.csv":
        raise UsageError("--out must not be called fixes.csv: the account of the fixes goes there.")
    if method not in ESTIMATORS:
        raise UsageError(f"--method must be one of {', '.join(ESTIMATORS)}, found {method!r}.")
    if smooth and method != "filter":
        raise UsageError(f"--smooth works on the filter, not on --method {method}.")
    if table_map is not None and method != "filter":
        raise UsageError(f"--table-map works on the filter, not on --method {method}.")
    if fit_after is not None and not 0.0 < fit_after <= UNITLESS:
        raise UsageError(f"--fit-after must be above zero and at most {UNITLESS:g}, found {fit_after:g}.")
    settings = PublishedMotion(
        gate_needs_both=gate_both,
        median_zeros=median_zeros,
        takes_exact_steps=exact_steps,
        fills_gated=fill_gated,
        fit_after_s=fit_after,
    )
    if settings != AS_PUBLISHED and method not in PUBLISHED:
        raise UsageError(f"options of the published methods go with --method {', '.join(PUBLISHED)}.")
    check_targets(out, out.with_name("fixes.csv"), plot, sources=inputs_of(folder, table_map))
    data = read_folder(folder)
    estimator = _estimator(data.noise, method, settings, table_map, smooth=smooth)
    with progress_line() as progress:
        states, accounts = estimate(data, estimator, partial(progress, "estimating"))
    if not any(states):
        raise UsageError(f"{folder}: no estimate comes of it: {why_nothing(accounts)}.")
    if isinstance(estimator, OfflineSmoother):
        later = iter(estimator.states())
        states = [next(later) if math.isfinite(t) else None for t in data.imu[:, 0].tolist()]
    contents: dict[Path, Content] = {
        out: _estimate_lines(data, states),
        out.with_name("fixes.csv"): _fix_lines(accounts),
    }
    if plot is not None:
        contents[plot] = png_of(draw_estimate(data, states, accounts))
    write_files(contents)
    spans = lost_spans(data, states)
    cause = likely_cause(data, spans) if spans else None
    for note in (*data.notes, *([] if cause is None else [cause])):
        sys.stderr.write(f"{note}.\n")
    _summarise(states, accounts, estimator, spans)


def _estimator(
    noise: NoiseModel, method: str, settings: PublishedMotion, table_map: Path | None, *, smooth: bool
) -> Estimator:
    known = None
    if table_map is not None:
        known = slope_grid(TableMap.load(table_map))
        noise = noise_with(noise, known)
    if smooth:
        return OfflineSmoother(noise, known)
    if method in PUBLISHED:
        return PUBLISHED[method](noise, settings)
    return ErrorStateFilter(noise, table_map=known) if known else ESTIMATORS[method](noise)


def _estimate_lines(data: FlightData, states: list[PlanarState | None]) -> Iterator[str]:
    yield ESTIMATE_HEADER
    empty = ",nan" * 12 + "\n"
    form = ",%.7f,%.7f,%.7f,%.7f,%.7f,%.7f,%.8f,%.8f,%.8f,%.7f,%.7f,%.8f\n"
    given_s = data.imu[:, 0] if data.given_s is None else data.given_s
    for t, state in zip(given_s.tolist(), states, strict=True):
        yield (f"{t:.6f}" if abs(t) < 1e15 else repr(t)) + (empty if state is None else form % state[1:13])


def _fix_lines(accounts: list[FixOutcome]) -> Iterator[str]:
    yield FIXES_HEADER
    for a in accounts:
        yield (
            f"{a.t_exposure_ns / NS:.6f},{int(a.used)},{a.reason},{a.innovation_x_m:.6f},"
            f"{a.innovation_y_m:.6f},{a.innovation_heading_rad:.7f},{a.nis:.3f}\n"
        )


def _summarise(
    states: list[PlanarState | None],
    accounts: list[FixOutcome],
    estimator: Estimator,
    spans: list[tuple[float, float]],
) -> None:
    used = sum(account.used for account in accounts)
    print(f"{len(states)} packets, {len(accounts)} fixes, {used} used.")
    for name, count in sorted(estimator.counters.by_name.items()):
        print(f"  {name.replace('_', ' ')}: {count}")
    for start_s, stop_s in spans:
        print(f"  the estimate was lost from {start_s:.2f} to {stop_s:.2f} s")
