"""`groundstation calibrate table-map`: the table's slope and waves from flights, and how to level it."""

from __future__ import annotations

import math
import re
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from calibration.result import provenance_of
from calibration.table.equations import FlightPriors, flight_equations
from calibration.table.from_fit import map_of
from calibration.table.prediction import check_outages
from calibration.table.separability import separability
from calibration.table.surface_basis import SurfaceBasis
from calibration.table.surface_fit import SurfaceFit, fit_surface
from groundstation.cli.errors import UsageError
from groundstation.cli.table_map_flights import Bounds, Source, read_source
from groundstation.files.errors import FileError
from groundstation.fusion.levelling import Levelling, levelling
from groundstation.fusion.table_map import G_M_S2, MapProvenance, TableMap

app = typer.Typer(no_args_is_help=True, add_completion=False, rich_markup_mode=None)

EDGE_M = 0.2
"""How far beyond the flown area a map reaches where no rig gives the table's edges."""
NOISE_WARNING = 1.5
SHORTEST_WAVE_M = 0.4
PRIORS = FlightPriors()


@app.command("table-map")
def table_map(
    flights: Annotated[list[Path], typer.Argument(help="Recordings (.mcap) or folders with imu.csv, ...")],
    out: Annotated[Path, typer.Option(help="TOML to write; the grid goes beside it as .npz.")],
    plot: Annotated[Path | None, typer.Option(help="PNG to draw as well.")] = None,
    leg: Annotated[
        list[str] | None,
        typer.Option(help="A leg of the table, NAME:X,Y in m; three or more. Else those of the rig."),
    ] = None,
    bounds: Annotated[
        str | None, typer.Option(help="Edges of the table in m: X_MIN,X_MAX,Y_MIN,Y_MAX.")
    ] = None,
    shortest_wave_m: Annotated[float, typer.Option(help="Shorter waves are left out.")] = SHORTEST_WAVE_M,
    check: Annotated[
        Path | None, typer.Option(help="A flight that is not learned from, to test the map on.")
    ] = None,
    rig: Annotated[Path | None, typer.Option(help="Rig file instead of the recorded one.")] = None,
    vehicle: Annotated[str | None, typer.Option(help="Only this vehicle of the recordings.")] = None,
) -> None:
    """Map the acceleration of a gliding vehicle over the table, with its uncertainty.

    Fly laps that cover the table with all headings, a rest at the start.

    Example: groundstation calibrate table-map laps.mcap --out table_map.toml --plot table_map.png
    --leg A:-1.8,-1.3 --leg B:1.8,-1.3 --leg C:1.8,1.3 --leg D:-1.8,1.3
    """
    legs = _legs(leg or [])
    given = None if bounds is None else _bounds(bounds)
    if not (math.isfinite(shortest_wave_m) and 0.15 <= shortest_wave_m <= 5.0):
        raise UsageError(f"--shortest-wave-m must lie within 0.15 and 5 m, found {shortest_wave_m:g}.")
    sources = [read_source(path, rig, vehicle) for path in flights]
    logs = [log for source in sources for log in source.logs]
    legs = legs or next((dict(source.legs_m) for source in sources if source.legs_m), {})
    fit, made = map_of_sources(sources, given, shortest_wave_m)
    advice = levelling(made.mean_m_s2, made.mean_cov_m2_s4, legs) if legs else None
    verdicts = _summary(fit, made, advice)
    if check is not None:
        verdicts += _check(read_source(check, rig, vehicle), made)
    if plot is not None:
        from groundstation.cli.table_map_figure import plot_map

        plot_map(made, fit.waviness_m_s2, logs, legs, advice, plot)
    try:
        made.save(out)
    except FileError as error:
        raise UsageError(str(error)) from error
    print("\n".join(verdicts))


def map_of_sources(
    sources: list[Source], bounds_m: Bounds | None = None, shortest_wave_m: float = SHORTEST_WAVE_M
) -> tuple[SurfaceFit, TableMap]:
    """Fit the table's surface, with every constant of each flight, and lay it on a grid.

    Raises:
        UsageError: the flights do not suffice.
    """
    basis = SurfaceBasis.over(bounds_m or _table_of(sources), shortest_wave_m)
    logs = [log for source in sources for log in source.logs]
    try:
        fit = fit_surface([flight_equations(log, basis, PRIORS) for log in logs], basis)
    except ValueError as error:
        raise UsageError(f"{error}.") from error
    return fit, map_of(fit, _provenance(fit, sources))


def _summary(fit: SurfaceFit, made: TableMap, advice: Levelling | None) -> list[str]:
    std = np.sqrt(made.mean_cov_m2_s4.diagonal())
    lines = [
        "Mean acceleration "
        + ", ".join(
            f"{axis} {1e3 * made.mean_m_s2[k]:+.3f} ± {1e3 * std[k]:.3f} mm/s²"
            f" ({1e3 * made.mean_m_s2[k] / G_M_S2:+.3f} mrad)"
            for k, axis in enumerate("xy")
        )
        + ".",
        f"Waves about it {1e3 * fit.waviness_m_s2:.2f} mm/s² per axis over {fit.length_m:.2f} m; "
        f"{fit.unknowns_learned:.0f} numbers learned from {fit.rows} measurements, "
        f"chi-square ratio {fit.chi_square_ratio:.2f}.",
    ]
    if fit.chi_square_ratio > NOISE_WARNING:
        lines.append(
            "Attention: the flights are noisier than their rig says, so all sigmas are "
            f"{fit.noise_factor**0.5:.1f} times larger "
            "(fix sigma too small, knocks of the valves, shocks of the floor?)."
        )
    lines += [verdict.sentence() for verdict in separability(fit)]
    return lines + (advice.sentences() if advice is not None else [])


def _check(source: Source, made: TableMap) -> list[str]:
    lines = []
    for log in source.logs:
        try:
            found = check_outages(log, made.accelerations_m_s2, made.mean_m_s2, PRIORS)
        except ValueError as error:
            raise UsageError(f"{error}.") from error
        lines.append(
            f"{log.name}: {found.outages} outages of {found.length_s:g} s end "
            f"{1e3 * found.with_map_m:.1f} mm off with the map, "
            f"{1e3 * found.mean_only_m:.1f} mm with the mean slope, "
            f"{1e3 * found.without_m:.1f} mm with none."
        )
    return lines


def _provenance(fit: SurfaceFit, sources: list[Source]) -> MapProvenance:
    now = datetime.now(UTC)
    notes: dict[str, float | str] = {
        "waviness_m_s2": fit.waviness_m_s2,
        "length_m": fit.length_m,
        "shortest_wave_m": fit.basis.shortest_wave_m,
        "noise_factor": fit.noise_factor,
    }
    for number, verdict in enumerate(separability(fit), start=1):
        notes[f"bias_and_slope_{number}"] = verdict.sentence()
    return MapProvenance(
        now,
        {source.path.name: provenance_of(source.path, now).recording_sha256 for source in sources},
        fit.chi_square_ratio,
        sum(flight.duration_s for flight in fit.flights),
        notes,
    )


def _table_of(sources: list[Source]) -> Bounds:
    """Return the table's edges by the rig, else what was flown and a little more."""
    for source in sources:
        if source.bounds_m is not None:
            return source.bounds_m
    places = np.concatenate([log.position_table_m for source in sources for log in source.logs])
    (x_min, y_min), (x_max, y_max) = places.min(axis=0) - EDGE_M, places.max(axis=0) + EDGE_M
    return float(x_min), float(x_max), float(y_min), float(y_max)


def _bounds(text: str) -> Bounds:
    try:
        x_min, x_max, y_min, y_max = (float(word) for word in text.split(","))
    except ValueError:
        raise UsageError(f"--bounds must be X_MIN,X_MAX,Y_MIN,Y_MAX in m, found {text!r}.") from None
    if not (-100.0 < x_min < x_max < 100.0 and -100.0 < y_min < y_max < 100.0):
        raise UsageError(f"--bounds must rise from min to max, in m, found {text!r}.")
    return x_min, x_max, y_min, y_max


def _legs(texts: list[str]) -> dict[str, tuple[float, float]]:
    legs: dict[str, tuple[float, float]] = {}
    for text in texts:
        found = re.fullmatch(r"\s*([^:]+):([^,]+),([^,]+)", text)
        try:
            place = (float(found[2]), float(found[3])) if found else (math.nan, math.nan)
        except ValueError:
            place = (math.nan, math.nan)
        if found is None or not all(map(math.isfinite, place)):
            raise UsageError(f"--leg must be NAME:X,Y with the place in m, found {text!r}.")
        if found[1] in legs:
            raise UsageError(f"--leg {found[1]} is given twice.")
        legs[found[1]] = place
    if legs:
        try:
            levelling((0.0, 0.0), np.eye(2), legs)
        except ValueError as error:
            raise UsageError(f"--leg: {error}.") from None
    return legs
