"""``groundstation reproduce``: published experiments run again, figure by figure."""

import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from groundstation.declarations.errors import UsageError
from groundstation.recording.errors import RecordingError
from groundstation.studies.running import StudyInterrupted
from groundstation.studies.running import reproduce as run_study
from groundstation.studies.study import FigureRow, Study
from groundstation.studies.table import studies

app = typer.Typer(rich_markup_mode=None)


@app.command()
def reproduce(
    study: Annotated[str | None, typer.Argument(help="Name of a study; without one they are listed.")] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for report.html, results.json and recordings of flights.")
    ] = None,
    figure: Annotated[
        str | None, typer.Option(help="Only the published figure or table of this number, such as 8 or 2.12.")
    ] = None,
) -> None:
    """Run a published experiment again: each figure beside the published number, and with our defaults.

    Data are made by the emulator under the published condition, as far as it is stated; what had to be
    assumed stands beside each figure, and a number that does not come out is shown as such. A folder that
    holds a report with more figures than are asked for is refused; one of the same or fewer is replaced.

    Example: groundstation reproduce

    Example: groundstation reproduce air-table --out try/air_table

    Example: groundstation reproduce air-table --out try/figure_16 --figure 16

    Example: groundstation reproduce chibis --out try/figure_2_12 --figure 2.12
    """
    known = studies()
    if study is None:
        if out is not None or figure is not None:
            raise UsageError(f"name a study: {', '.join(known)}.")
        for each in known.values():
            _print_study(each)
        return
    if study not in known:
        raise UsageError(f"there is no study {study!r}: there are {', '.join(known)}.")
    if out is None:
        raise UsageError("--out is needed: the folder for report.html and results.json.")
    chosen = known[study]
    rows = _rows(chosen, figure)
    columns = TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn()
    with Progress(*columns, console=Console(stderr=True), disable=not sys.stderr.isatty()) as bar:
        task = bar.add_task("", total=1.0)
        try:
            written = run_study(
                chosen, rows, out, lambda text, done: bar.update(task, description=text, completed=done)
            )
        except RecordingError as error:
            raise UsageError(str(error)) from error
        except StudyInterrupted as stop:
            bar.stop()
            sys.stderr.write(f"groundstation: {stop}\n")
            raise typer.Exit(130) from stop
    for path in written:
        print(path)


def _print_study(study: Study) -> None:
    print(f"{study.name}: {study.title}")
    for row in study.figures:
        print(f"  {row.label}: {row.title}")


def _labels(study: Study) -> str:
    """What it draws, in numbers: ``figures 2, 3; tables 1, 2``."""
    numbers: dict[str, list[str]] = {}
    for row in study.figures:
        numbers.setdefault(row.kind, []).extend(map(str, row.numbers))
    return "; ".join(
        f"{kind}{'s' if len(known) > 1 else ''} {', '.join(known)}" for kind, known in numbers.items()
    )


def _rows(study: Study, figure: str | None) -> list[FigureRow]:
    if figure is None:
        return list(study.figures)
    rows = [row for row in study.figures if figure in map(str, row.numbers)]
    if not rows:
        raise UsageError(f"{study.name} has no figure {figure} to draw: it draws {_labels(study)}.")
    return rows
