"""``groundstation watch``: what a running rig publishes on a topic, line by line."""

import csv
import shutil
import sys
from typing import Annotated

import typer

from groundstation.declarations.errors import UsageError
from groundstation.declarations.message import Message
from groundstation.launch.observer import follow
from groundstation.launch.running import RunningRig, choose_runs, find_running
from groundstation.parts.table import installed_tables
from groundstation.watch.pick import STAMP, Pick, field_names, picked, shown, stamp_text, topic_names

app = typer.Typer(rich_markup_mode=None)

EVERY_S = 0.5
"""On a terminal, where nothing else is asked for."""
_HEAD_EVERY = 20


def _names(incomplete: str) -> list[str]:
    """What can be completed: topics of the rigs that run, behind the dot their fields."""
    payloads = installed_tables().payloads
    vehicles = [name for run in find_running() for name in run.vehicles]
    topic, dot, _ = incomplete.partition(".")
    names = topic_names(payloads, vehicles)
    if dot and topic in names:
        names = [f"{topic}.{field}" for field in field_names(payloads[topic.rpartition("/")[2]])]
    return [name for name in names if name.startswith(incomplete)]


@app.command()
def watch(
    topic: Annotated[str, typer.Argument(help="OWNER/TOPIC, or OWNER/TOPIC.FIELD.", autocompletion=_names)],
    every: Annotated[
        float | None,
        typer.Option(help="Seconds between lines; default 0.5 on a terminal, else every message.", min=0.0),
    ] = None,
    count: Annotated[int | None, typer.Option(help="End after so many lines.", min=1)] = None,
    pid: Annotated[int | None, typer.Option(help="Process of the run, where several are going on.")] = None,
) -> None:
    """Show what a running rig publishes, until Ctrl-C; lines of CSV where stdout is no terminal.

    `groundstation parts` lists the topics. Topics of the whole rig have no owner: lease, recorder_status.
    Stamps are of the host's monotonic clock.

    Exit code 0; 1 where the rig ended before --count lines.

    Example: groundstation watch alpha/state.position_table_m

    Example: groundstation watch alpha/fix_account --every 0 > fixes.csv
    """
    run = _run_of(topic, choose_runs(pid))
    pick = picked(topic, installed_tables().payloads, run.vehicles)
    is_terminal = sys.stdout.isatty()
    every_s = (EVERY_S if is_terminal else 0.0) if every is None else every
    lines = _Table(pick) if is_terminal else _Csv(pick)
    left = count
    try:
        for message in follow(run, pick, every_s, _note):
            lines.write(message)
            if left is not None:
                left -= 1
                if not left:
                    return
    except KeyboardInterrupt:
        return
    sys.stderr.write(f"{run.rig} has ended\n")
    if left:
        raise typer.Exit(1)


def _run_of(topic: str, runs: list[RunningRig]) -> RunningRig:
    """The run that a topic belongs to.

    Raises:
        UsageError: Several do.
    """
    owner = topic.removeprefix("/").partition("/")[0]
    fitting = [run for run in runs if owner in run.vehicles] or runs
    if len(fitting) > 1:
        known = ", ".join(f"{run.pid} ({run.rig})" for run in fitting)
        raise UsageError(f"several rigs run: choose one with --pid: {known}")
    return fitting[0]


class _Csv:
    """Lines of CSV, each flushed: whoever reads them reads them now.

    The names come with the first line: a rig that is not reached leaves an empty file.
    """

    def __init__(self, pick: Pick) -> None:
        self._pick = pick
        self._out = csv.writer(sys.stdout, lineterminator="\n")
        self._has_head = False

    def write(self, message: Message) -> None:
        """Write a message."""
        if not self._has_head:
            self._has_head = True
            self._put([STAMP, *(column.name for column in self._pick.columns)])
        values = (shown(column.value(message), exact=True) for column in self._pick.columns)
        self._put([stamp_text(message.stamp_ns), *values])

    def _put(self, row: list[str]) -> None:
        self._out.writerow(row)
        sys.stdout.flush()


class _Table:
    """Columns for eyes, their names again each screenful; a message of many fields as one line each."""

    def __init__(self, pick: Pick) -> None:
        self._pick = pick
        self._widths = [max(len(column.name), 10) for column in pick.columns]
        self._lines = 0
        self._is_wide = sum(self._widths) + 2 * len(self._widths) > shutil.get_terminal_size().columns - 16

    def write(self, message: Message) -> None:
        """Write a message."""
        stamp = f"{message.stamp_ns * 1e-9:.3f}"
        values = [shown(column.value(message), exact=False) for column in self._pick.columns]
        if self._is_wide:
            width = max(map(len, (column.name for column in self._pick.columns)))
            print(f"{stamp} s")
            for column, value in zip(self._pick.columns, values, strict=True):
                print(f"  {column.name:<{width}}  {value}")
            sys.stdout.flush()
            return
        if self._lines % _HEAD_EVERY == 0:
            names = (f"{c.name:>{w}}" for c, w in zip(self._pick.columns, self._widths, strict=True))
            print("  ".join([f"{STAMP:>14}", *names]))
        self._lines += 1
        cells = (f"{value:>{w}}" for value, w in zip(values, self._widths, strict=True))
        print("  ".join([f"{stamp:>14}", *cells]), flush=True)


def _note(line: str) -> None:
    sys.stderr.write(f"{line}\n")
