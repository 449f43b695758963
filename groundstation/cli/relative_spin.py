"""`groundstation relative spin`: rates of a stage in regular precession, run by run."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from numpy.typing import NDArray

from groundstation.cli.progress import with_progress
from groundstation.data_sets.relative_stage import load_stage, read_runs
from groundstation.files.number_tables import csv_text
from groundstation.files.writing import check_targets, write_files
from groundstation.relative_navigation.error_table import PUBLISHED_STAGE, error_statistics
from groundstation.relative_navigation.stage_spin import StageFit, fit_stage

COLUMNS = ("run", "wx", "wy", "wz")


def spin(
    stage: Annotated[Path, typer.Argument(help="STAGE.json: In, Ix, markers_m, f_px, camera, sigma_px.")],
    pixels: Annotated[Path, typer.Option(help="CSV of the runs: run,t,marker,u,v.")],
    out: Annotated[
        Path, typer.Option(help="CSV to write: run,wx,wy,wz in rad/s, body axes, at t = 0; nan if unknown.")
    ],
) -> None:
    """Find the rates of a stage in regular precession from a few frames of each run.

    Where the stage file has the true rate (omega_deg_s), the statistics of the published table follow by its
    own formulas, beside honest ones.

    Example: groundstation relative spin stage.json --pixels 3frames.csv --out rates.csv
    """
    check_targets(out, sources=[stage, pixels])
    case = load_stage(stage, pixels)
    runs = read_runs(pixels, case.stage)
    fits = {
        name: fit_stage(case.stage, runs[name], case.sigma_px)
        for name in with_progress(list(runs), "fitting")
    }
    rows = [(str(name), *(f"{w:.10g}" for w in _known_rate(fit))) for name, fit in fits.items()]
    write_files({out: csv_text(COLUMNS, rows)})
    _report(list(fits.values()), case.truth_rad_s)


def _known_rate(fit: StageFit) -> NDArray[np.float64]:
    return fit.rate_rad_s if fit.converged else np.full(3, np.nan)


def _report(fits: list[StageFit], truth: NDArray[np.float64] | None) -> None:
    known = [fit for fit in fits if fit.converged]
    bad = len(fits) - len(known)
    aside = f", {bad} without a known rate (nan; left out of what follows)"
    print(f"{len(fits)} runs{aside if bad else ''}.")
    for reason, count in sorted(Counter(fit.reason for fit in fits if fit.reason).items()):
        print(f"  {reason}: {count}")
    if not known:
        return
    rates = np.degrees([fit.rate_rad_s for fit in known])
    middle = rates.mean(axis=0)
    print("mean rate, deg/s: " + " ".join(f"{w:.4f}" for w in middle))
    expected = np.degrees(np.sqrt(np.mean([np.diag(fit.covariance)[3:] for fit in known], axis=0)))
    print("sigma of one run by its covariance, deg/s: " + " ".join(f"{s:.4f}" for s in expected))
    if truth is None or len(known) < 2:
        return
    print("axis   mean  mean|d|  D=S/(n(n-1))  sqrt(D)  sample var  sigma    rms   published M, D, sigma")
    for axis, (name, published) in enumerate(PUBLISHED_STAGE.items()):
        found = error_statistics(rates[:, axis] - np.degrees(truth[axis]))
        print(
            f"{name}   {found.mean:8.4f} {found.mean_absolute:8.4f}  {found.published_variance:12.3e}"
            f" {found.published_sigma:8.4f}  {found.variance:10.3e} {found.sigma:6.4f} {found.rms:6.4f}"
            f"   {published[0]:g}, {published[1]:g}, {published[2]:g}"
        )
