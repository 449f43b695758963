"""``groundstation report``: figures and numbers of a recording."""

import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn

from groundstation.declarations.errors import UsageError
from groundstation.recording.errors import RecordingError
from groundstation.watch.report import write_report
from groundstation.watch.verdict import Verdict

app = typer.Typer(rich_markup_mode=None)


@app.command()
def report(
    recording: Annotated[Path, typer.Argument(help="Recording (.mcap).")],
    out: Annotated[Path, typer.Option(help="Folder for figures and report.json.")],
) -> None:
    """Draw the figures of a recording and write its numbers to report.json.

    Example: groundstation report recordings/2025-03-01_12-00-00.mcap --out report
    """
    print_report(recording, out)


def print_report(
    recording: Path, out: Path, *, verdict: Verdict | None = None, compare: Path | None = None
) -> None:
    """Write the report and name its files.

    Raises:
        UsageError: The recording cannot be read or holds no vehicle, or the folder cannot be written.
    """
    columns = TextColumn("{task.description}"), BarColumn()
    with Progress(*columns, console=Console(stderr=True), disable=not sys.stderr.isatty()) as bar:
        task = bar.add_task("", total=1.0)
        try:
            written = write_report(
                recording,
                out,
                lambda text, done: bar.update(task, description=text, completed=done),
                verdict=verdict,
                compare=compare,
            )
        except RecordingError as error:
            raise UsageError(str(error)) from error
        except OSError as error:
            raise UsageError(f"{out} cannot be written: {error.strerror}") from error
    for path in written:
        print(f"report: {path}")
