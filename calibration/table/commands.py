"""`groundstation calibrate table-map`: the table's slope and waves from flights, and how to level it."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from calibration.delivery import refusing
from calibration.table.figures import draw_map
from calibration.table.procedure import SHORTEST_WAVE_M, check_on, map_of_sources, summary_of
from calibration.table.smoothed_flights import Bounds, read_source
from groundstation.cli.plot_option import Plot
from groundstation.data_sets.inputs import inputs_of
from groundstation.declarations.errors import UsageError
from groundstation.files.png import png_of
from groundstation.files.writing import check_targets, write_files
from groundstation.fusion.levelling import levelling


def table_map(
    flights: Annotated[list[Path], typer.Argument(help="Recordings (.mcap) or folders with imu.csv, ...")],
    out: Annotated[Path, typer.Option(help="TOML to write; the grid goes beside it as .npz.")],
    plot: Plot = None,
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
    check_targets(out, out.with_suffix(".npz"), plot, sources=inputs_of(*flights, check, rig))
    legs, given = _legs(leg or []), None if bounds is None else _bounds(bounds)
    if not (math.isfinite(shortest_wave_m) and 0.15 <= shortest_wave_m <= 5.0):
        raise UsageError(f"--shortest-wave-m must lie within 0.15 and 5 m, found {shortest_wave_m:g}.")
    with refusing():
        sources = [read_source(path, rig, vehicle) for path in flights]
        legs = legs or next((dict(source.legs_m) for source in sources if source.legs_m), {})
        fit, made = map_of_sources(sources, given, shortest_wave_m)
        advice = levelling(made.mean_m_s2, made.mean_covariance_m2_s4, legs) if legs else None
        sentences = summary_of(fit, made, advice)
        if check is not None:
            sentences += check_on(read_source(check, rig, vehicle), made)
    files = made.files(out)
    if plot is not None:
        logs = [log for source in sources for log in source.logs]
        files[plot] = png_of(draw_map(made, fit.waviness_m_s2, logs, legs, advice))
    write_files(files)
    print("\n".join(sentences))


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
