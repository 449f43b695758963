"""``groundstation report``: the page and the numbers of a recording."""

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
    out: Annotated[Path, typer.Option(help="Folder for report.html and report.json.")],
    compare: Annotated[
        Path | None, typer.Option(help="Recording (.mcap) of a second run, drawn beneath the first.")
    ] = None,
) -> None:
    """Draw a recording on one page, report.html, and write its numbers to report.json.

    The page holds everything it shows: it can be sent, printed and kept.

    Example: groundstation report recordings/2025-03-01_12-00-00.mcap --out report

    Example: groundstation report recordings/today.mcap --compare recordings/before.mcap --out report
    """
    print_report(recording, out, compare=compare)


def print_report(
    recording: Path, out: Path, verdict: Verdict | None = None, compare: Path | None = None
) -> None:
    """Write the report and name its files.

    Args:
        recording: Of the run.
        out: Folder.
        verdict: On the run, where a scenario was flown.
        compare: Recording of a second run.

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
                verdict,
                compare,
            )
        except RecordingError as error:
            raise UsageError(str(error)) from error
        except OSError as error:
            raise UsageError(f"{out} cannot be written: {error.strerror}") from error
    for path in written:
        print(f"report: {path}")
