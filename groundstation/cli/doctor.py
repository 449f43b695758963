"""``groundstation doctor``: whether this machine is fit for a flight day."""

import json
import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.text import Text

from groundstation.launch.checkup.checkup import examine
from groundstation.launch.checkup.finding import Finding, Machine, Verdict
from groundstation.rig.read import load_rig

app = typer.Typer(rich_markup_mode=None)

_STYLES = {Verdict.OK: "green", Verdict.WARN: "yellow", Verdict.BAD: "red"}


@app.command()
def doctor(
    rig: Annotated[
        Path | None, typer.Argument(help="Rig file: its devices are looked at; without it, all there are.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON list instead of lines.")] = False,
    root: Annotated[Path, typer.Option(help="Where the machine's files begin.", hidden=True)] = Path("/"),
) -> None:
    """Check this machine before a flight day, and say what to do.

    It looks at the processors' clock, the right to go first, memory, power, disk and clocks; and at the
    serial lines, cameras and CAN interfaces that a rig names, or that are plugged in. It changes nothing.
    Do not call it while the rig flies: it opens the cameras.

    Exit code 0; 1 where something is BAD.

    Example: groundstation doctor examples/rigs/two_mock_ups.toml
    """
    loaded = None if rig is None else load_rig(rig)
    findings = []
    console = Console(highlight=False)
    for finding in examine(Machine.of_process(root), loaded, _looking):
        findings.append(finding)
        if not as_json:
            console.print(_line(finding), soft_wrap=True)  # what to do is copied as one line
    if as_json:
        print(json.dumps([_as_dict(finding) for finding in findings], indent=1))
    if any(finding.verdict is Verdict.BAD for finding in findings):
        raise typer.Exit(1)


def _line(finding: Finding) -> Text:
    verdict = finding.verdict
    line = Text.assemble((f"{verdict.value:<4}", _STYLES[verdict]), f"  {finding.subject}: {finding.what}")
    if finding.advice:
        line.append(f"\n      -> {finding.advice}")
    return line


def _as_dict(finding: Finding) -> dict[str, str]:
    return {
        "verdict": finding.verdict.value,
        "subject": finding.subject,
        "what": finding.what,
        "advice": finding.advice,
    }


def _looking(subject: str) -> None:
    """Tell on a terminal what takes a while."""
    if sys.stderr.isatty():
        sys.stderr.write(f"looking at {subject} ...\n")
