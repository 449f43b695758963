"""``groundstation replay``: feed a recording through the nodes again and compare."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from groundstation.declarations.errors import UsageError
from groundstation.declarations.node import Node
from groundstation.declarations.rig import Rig
from groundstation.files.errors import FileError
from groundstation.parts.table import installed_tables
from groundstation.recording.errors import RecordingError
from groundstation.recording.info import RecordingInfo
from groundstation.recording.reader import Recording
from groundstation.recording.software import software
from groundstation.recording.writer import Recorder
from groundstation.rig.plan import make_node
from groundstation.rig.provenance import changed_files, portable, recorded_rig
from groundstation.rig.read import parse_rig, read_text
from groundstation.runners.replay import ReplayRunner
from groundstation.runners.replay_report import ReplayReport
from groundstation.runners.tolerances import EXACT, Tolerances, load_tolerances

app = typer.Typer(rich_markup_mode=None)

_WIDTH = 100  # on a pipe too: names are never cut


@app.command()
def replay(
    recording: Annotated[Path, typer.Argument(help="Recording (.mcap).")],
    node: Annotated[
        list[str] | None,
        typer.Option(help="Node to replay, e.g. alpha/fusion; may be repeated. Default: all."),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Write what the nodes publish now (.mcap).")] = None,
    rig: Annotated[Path | None, typer.Option(help="Rig file to use instead of the recorded one.")] = None,
    tolerances: Annotated[
        Path | None, typer.Option(help="TOML of differences to forgive; without it every bit counts.")
    ] = None,
) -> None:
    """Feed a recording through the nodes again and compare what they publish with what they published.

    Exit code 0 if all agrees, 1 if something differs.

    Example: groundstation replay run.mcap --node alpha/fusion --out fusion.mcap
    """
    allowed = EXACT if tolerances is None else load_tolerances(tolerances, installed_tables().payloads)
    try:
        with Recording(recording) as found:
            report = _replay(found, node, out, rig, allowed)
    except RecordingError as error:
        raise UsageError(str(error)) from error
    _print_report(report)
    if not report.agrees:
        raise typer.Exit(1)


def _replay(
    found: Recording, nodes: list[str] | None, out: Path | None, rig_path: Path | None, allowed: Tolerances
) -> ReplayReport:
    info, rig = _rig_of(found, rig_path)
    for sentence in (*found.missing(), *changed_files(rig, found.info)):
        print(sentence)
    if info.software not in ("", software()):
        print(
            f"recorded with {info.software}, replayed with {software()}: figures may differ by their rounding"
        )
    output = None if out is None else Recorder(out, replace(info, software=software()))
    try:
        report = ReplayRunner(found, _factory(rig), nodes, allowed, output).run()
        if output is not None:
            output.finish()
    except BaseException:  # no partial output, not even on Ctrl-C
        if output is not None:
            output.discard()
        raise
    if output is not None:
        print(f"replayed: {output.path}")
    return report


def _rig_of(found: Recording, rig_path: Path | None) -> tuple[RecordingInfo, Rig]:
    info = found.info
    if rig_path is not None:
        info = replace(info, rig_toml=read_text(rig_path), rig_path=portable(rig_path))
        return info, parse_rig(info.rig_toml, rig_path)
    if not info.rig_toml:
        raise UsageError(f"{found.path} carries no rig: give one with --rig")
    return info, recorded_rig(found)


def _factory(rig: Rig) -> Callable[[str], Node]:
    def make(key: str) -> Node:
        try:
            return make_node(rig, key)
        except FileError as error:
            raise UsageError(f"{key} cannot be made: {error}") from error

    return make


def _print_report(report: ReplayReport) -> None:
    console = Console()
    console.width = max(console.width, _WIDTH)
    for reason in report.refused.values():
        print(reason)
    if report.before_start:
        print(f"{report.before_start} journal entries stand before the first start of their node: left out")
    table = Table(
        "topic",
        "of",
        "equal",
        "close",
        "different",
        "missing",
        "extra",
        "unrecorded",
        box=None,
        pad_edge=False,
    )
    for result in report.results:
        counts = (
            result.equal,
            result.close,
            result.different,
            result.missing,
            result.extra,
            result.unrecorded,
        )
        table.add_row(result.noun, result.owner, *(str(count) if count else "" for count in counts))
    console.print(table)
    for sentence in report.differences():
        print(sentence)
    verdict = "all agrees" if report.agrees else "NOT the same"
    print(f"{len(report.nodes)} nodes, {report.inputs} inputs, {report.ticks} ticks: {verdict}")
