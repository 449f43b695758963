"""`groundstation calibrate laboratory`: the emulated laboratory of a rig from an ordinary flight."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from calibration.delivery import refusing
from calibration.laboratory.figures import draw_laboratory
from calibration.laboratory.findings import Findings, sentence
from calibration.laboratory.procedure import fit_laboratory
from calibration.laboratory.written import laboratory_json, laboratory_toml
from calibration.result import provenance_of
from groundstation.cli.plot_option import Plot
from groundstation.cli.progress import progress_line
from groundstation.data_sets.inputs import inputs_of
from groundstation.declarations.errors import UsageError
from groundstation.files.png import png_of
from groundstation.files.writing import Content, check_targets, write_files


def laboratory(
    source: Annotated[Path, typer.Argument(help="Recording (.mcap) of a flight to and fro.")],
    out: Annotated[Path, typer.Option(help="TOML to write; numbers go beside it as .json.")],
    plot: Plot = None,
    vehicle: Annotated[str | None, typer.Option(help="Only this vehicle of the recording.")] = None,
    rig: Annotated[Path | None, typer.Option(help="Rig file instead of the recorded one.")] = None,
) -> None:
    """Estimate what the emulator guesses: thrust and timing of each valve, tilt and waves, noise, camera.

    Fly to and fro for one to two minutes, turning on the way. Written is the [laboratory] part of a rig, each
    number with its sigma; what the flight does not tell is left out and named with the reason. Mass,
    places and directions of the valves are the rig's and taken as true.

    Example: groundstation calibrate laboratory yesterday.mcap --out laboratory.toml --plot laboratory.png
    """
    numbers = out.with_suffix(".json")
    if numbers == out:
        raise UsageError(f"--out must not end in .json, found {out}: the numbers go there.")
    check_targets(out, numbers, plot, sources=inputs_of(source, rig))
    with refusing(source), progress_line() as progress:
        fitted = fit_laboratory(source, vehicle, rig, progress)
    provenance = provenance_of(source)
    files: dict[Path, Content] = {
        out: laboratory_toml(fitted, provenance),
        numbers: laboratory_json(fitted, provenance),
    }
    if plot is not None:
        files[plot] = png_of(draw_laboratory(fitted))
    write_files(files)
    for warning in (*fitted.warnings, *fitted.grounded.values()):
        sys.stderr.write(f"{source}: {warning}.\n")
    _tell("", fitted.table)
    for each in fitted.vehicles:
        _tell(f"{each.name}.", each.findings)


def _tell(prefix: str, findings: Findings) -> None:
    for key, found in findings.found.items():
        print(sentence(prefix + key, found))
    for key, reason in findings.unseen.items():
        print(f"{prefix}{key}: not found: {reason}.")
    for each in findings.assumed:
        print(f"Taken as true: {each}.")
