"""``groundstation recording``: look into a recording, draw and cut it, recover a torn one."""

import tomllib
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from groundstation.bus.envelope import Cause
from groundstation.cli import (
    recording_compare,
    recording_cut,
    recording_export,
    recording_film,
    recording_pictures,
    recording_plot,
)
from groundstation.cli.number_options import MOST_MESSAGES
from groundstation.declarations.errors import GroundStationError, UsageError
from groundstation.recording.causes import CauseIndex
from groundstation.recording.errors import NothingRecoveredError, RecordingError
from groundstation.recording.info import RecordingInfo
from groundstation.recording.reader import Recording
from groundstation.recording.recover import recover as recover_file
from groundstation.recording.run_files import PART_SUFFIX
from groundstation.watch.run_folder import kept_words

app = typer.Typer(no_args_is_help=True, rich_markup_mode=None)
app.command()(recording_pictures.pictures)
app.command()(recording_export.export)
app.command()(recording_plot.plot)
app.command()(recording_compare.compare)
app.command()(recording_cut.cut)
app.command()(recording_film.film)


@app.callback()
def recording() -> None:
    """Look into recordings: tables, plots, films, comparisons, cuts; recover a torn one."""


@app.command()
def info(file: Annotated[Path, typer.Argument(help="Recording (.mcap), or the folder of a run.")]) -> None:
    """Say what a recording holds: where it comes from, and every topic with its rate.

    Example: groundstation recording info recordings/2026-03-01_14-05-00_two_mock_ups
    """
    try:
        with Recording(file) as found:
            _print_info(found)
    except RecordingError as error:
        raise UsageError(str(error)) from error


@app.command()
def recover(
    file: Annotated[Path, typer.Argument(help="Torn recording, usually ….mcap.part; it is left as it is.")],
    out: Annotated[Path | None, typer.Option(help="Recording to write (.mcap).")] = None,
) -> None:
    """Bring everything readable of a torn or damaged recording into a new one.

    Exit code 1 where nothing can be read: then no file is written.

    Example: groundstation recording recover recordings/2026-03-01_14-05-00_two_mock_ups/recording.mcap.part
    """
    target = out or _recovered_name(file)
    try:
        found = recover_file(file, target)
    except NothingRecoveredError as error:
        raise GroundStationError(str(error)) from error
    except RecordingError as error:
        raise UsageError(str(error)) from error
    print(f"{target}: {found.messages} messages")
    if found.was_finished:
        print(f"{file} had been finished properly")
    if found.torn_bytes:
        print(f"{found.torn_bytes} bytes at the torn end held no more messages")
    if found.lost_bytes:
        print(f"{found.lost_bytes} bytes within are no record: passed over")
    for gap in found.gaps:
        print(gap.sentence(found.start_ns))
    if found.orphans:
        print(f"{found.orphans} messages were left out: their channel stood in a damaged chunk")


@app.command()
def causes(
    file: Annotated[Path, typer.Argument(help="Recording (.mcap).")],
    vehicle: Annotated[str, typer.Argument(help="Vehicle, or process for topics that processes own.")],
    topic: Annotated[str, typer.Argument(help="Topic, e.g. valve_command.")],
    sequence: Annotated[int, typer.Argument(help="Number of the message.", min=1, max=MOST_MESSAGES)],
) -> None:
    """Name all that a message was made from, back to bytes and light, with its age.

    Example: groundstation recording causes run.mcap alpha valve_command 1000
    """
    with Recording(file) as found:
        if topic not in {channel.noun for channel in found.channels}:
            raise UsageError(f"no topic is called {topic!r}; `groundstation recording info` lists them")
        index = CauseIndex(found)
    wanted = Cause(topic, vehicle, sequence)
    given_ns = index[wanted].given_ns
    table = Table(box=None, pad_edge=False)
    for heading, width in (("back", 4), ("message", 24), ("number", 6), ("made by", 21)):
        table.add_column(heading, no_wrap=True, min_width=width)
    table.add_column("age / ms", justify="right")
    table.add_column("took / ms", justify="right")
    for steps, origin in index.chain(wanted):
        reference = origin.message
        name = f"{reference.owner}/{reference.noun}".removeprefix("/")
        age_ms, took_ms = (given_ns - origin.given_ns) * 1e-6, origin.wall_ns * 1e-6
        made_by = origin.node or "a port"
        table.add_row(
            str(steps),
            name,
            str(reference.sequence),
            made_by,
            f"{age_ms:.2f}",
            f"{took_ms:.2f}" if took_ms else "",
        )
    Console().print(table)


def _recovered_name(file: Path) -> Path:
    whole = file.with_name(file.name.removesuffix(PART_SUFFIX))
    return whole if not whole.exists() else whole.with_stem(f"{whole.stem}_recovered")


def _print_info(found: Recording) -> None:
    span_s = (found.stop_ns - found.start_ns) * 1e-9
    reported = found.info
    count = sum(channel.count for channel in found.channels)
    size_mb = sum(path.stat().st_size for path in found.files) / 1e6
    print(f"{found.path}: {span_s:.1f} s, {count} messages, {size_mb:.2f} MB")
    if found.path.is_dir():
        print(f"recordings: {', '.join(path.name for path in found.files)}")
        for line in kept_words(found.path):
            print(line)
    print(
        f"rig: {_rig_name(reported)}; images: {reported.images.value}; by: {reported.software or 'unknown'}"
    )
    if reported.utc_offset_ns is None:
        print("clock: virtual" + ("" if reported.seed is None else f"; seed: {reported.seed}"))
    else:
        start = datetime.fromtimestamp(0, UTC) + timedelta(
            microseconds=(found.start_ns + reported.utc_offset_ns) // 1000
        )
        print(f"start: {start:%Y-%m-%d %H:%M:%S} UTC")
    for sentence in found.missing():
        print(sentence)
    for name, digest in reported.calibration_sha256.items():
        print(f"calibration {name}: sha256 {digest[:16]}…")
    table = Table("topic", "of", "messages", "rate / Hz", box=None, pad_edge=False)
    for channel in found.channels:
        rate_hz = f"{(channel.count - 1) / span_s:.1f}" if span_s > 0 and channel.count > 1 else ""
        table.add_row(channel.noun, channel.owner, str(channel.count), rate_hz)
    Console().print(table)


def _rig_name(reported: RecordingInfo) -> str:
    try:
        return str(tomllib.loads(reported.rig_toml).get("name", reported.rig_path or "unnamed"))
    except tomllib.TOMLDecodeError:
        return "unreadable"
