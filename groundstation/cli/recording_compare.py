"""``groundstation recording compare``: two runs laid over each other."""

import math
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from groundstation.cli.report import print_report
from groundstation.cli.run_progress import RunProgress
from groundstation.declarations.errors import UsageError
from groundstation.files.writing import check_folder
from groundstation.parts.table import installed_tables
from groundstation.recording.errors import RecordingError
from groundstation.watch.comparison import Comparison, compare_runs


def compare(
    first: Annotated[Path, typer.Argument(help="Recording (.mcap), or the folder of a run.")],
    second: Annotated[Path, typer.Argument(help="The other one.")],
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for report.html and report.json, both runs drawn over each other."),
    ] = None,
) -> None:
    """Lay two runs over each other: every figure of both, and how far apart the vehicles flew.

    Both count from the moment when their last vehicle flies.

    Example: groundstation recording compare recordings/before recordings/after --out try/compared
    """
    if out is not None:
        check_folder(out)
    try:
        with RunProgress(1.0) as progress:
            progress("reading both recordings", 0.0)
            found = compare_runs(first, second, installed_tables())
    except RecordingError as error:
        raise UsageError(str(error)) from error
    _print(found, first, second)
    if out is not None:
        print_report(first, out, compare=second)


def _print(found: Comparison, first: Path, second: Path) -> None:
    names = (first.name, second.name) if first.name != second.name else (str(first), str(second))
    print(f"A: {names[0]}, {found.first.duration_s:.1f} s, rig {found.first.rig.name or 'unknown'}")
    print(f"B: {names[1]}, {found.second.duration_s:.1f} s, rig {found.second.rig.name or 'unknown'}")
    for sentence in (*found.first.missing, *found.second.missing):
        print(sentence)
    for apart in found.apart:
        print(apart.sentence())
    table = Table(box=None, pad_edge=False)
    for heading in ("vehicle", "figure"):
        table.add_column(heading, no_wrap=True)
    for heading in ("A", "B", "B against A"):
        table.add_column(heading, justify="right", no_wrap=True)
    for row in found.figures:
        table.add_row(row.vehicle, row.what, _number(row.first), _number(row.second), row.change)
    Console().print(table)


def _number(value: float) -> str:
    return "" if math.isnan(value) else f"{value:.4g}"
