"""What ``groundstation run`` shows on a terminal: mock-ups, ages, processes, ports, events."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich import box
from rich.console import Console, Group
from rich.live import Live
from rich.panel import Panel
from rich.segment import Segment, Segments
from rich.table import Table
from rich.text import Text

from groundstation.declarations.view import NOTHING, Cell, Level
from groundstation.watch.ledger import STAGES
from groundstation.watch.monitor import EVENTS_KEPT

if TYPE_CHECKING:  # it brings the bus along
    from groundstation.launch.live_run import LiveRun

_GOOD, _BAD, _DIM, _WARN = "green", "red", "bright_black", "yellow"
_STYLES = {
    Level.PLAIN: "",
    Level.GOOD: _GOOD,
    Level.WARNING: _WARN,
    Level.BAD: _BAD,
    Level.FAINT: _DIM,
}
_STAGES = {
    "exposure": "exposure",
    "arrival": "picture arrived",
    "spots": "spots found",
    "fix": "fix published",
    "state": "in the state",
    "wrench": "in the wrench",
    "guard": "past the guard",
    "bus": "on the valve bus",
    "bytes_to_state": "IMU bytes to state",
}
_MOST_COLUMNS = 4  # of vehicles beside each other on 120 characters
_LEAST_EVENTS, _MOST_EVENTS = 2, EVENTS_KEPT
_LEAST_ROWS = 2  # of a vehicle: its mode and its faults
_AROUND_ROWS = 4  # heading and rule, and the empty lines around
_AROUND_EVENTS = 2  # the frame
_WIDEST_LABEL, _NARROW_LABEL, _NARROW = 24, 18, 100
"""Characters of a row's name; on a terminal narrower than the last, numbers have the room."""
_BETWEEN = 2  # spaces around a column
_SPACES = re.compile(" {2,}")
_EMPTY = ("", NOTHING.text)


class TerminalView:
    """Draws a live run with rich, or writes it as lines."""

    def __init__(self, live: LiveRun, console: Console) -> None:
        self._run = live
        self._console = console
        self._live: Live | None = None
        self._waited_for = ""
        self._greeted: set[str] = set()
        self._lower_shows: object = None
        self._lower_lines = 0
        self._rendered = Segments([])
        self._keys = ""

    @contextmanager
    def opened(self, *, headless: bool, keys: str = "") -> Iterator[None]:
        """Keep the screen while the run lasts; the last picture stays.

        Args:
            headless: Lines are written instead.
            keys: What keys do; empty where none are read.
        """
        self._keys = keys
        if headless:
            if keys:
                self._run.monitor.note(f"keys: {keys}")
            yield
            return
        with Live(self._draw(), console=self._console, auto_refresh=False, screen=False) as live:
            self._live = live
            yield
            live.update(self._draw(), refresh=True)
        self._live = None

    def refresh(self) -> None:
        """Draw the newest values."""
        if self._live is not None:
            self._live.update(self._draw(), refresh=True)

    def print_tidings(self) -> None:
        """What happened since the last call, one line each."""
        waiting = self._run.launcher.waiting_for
        waited_for = f"starting: waiting for {', '.join(waiting)}" if waiting else "all processes are ready"
        if waited_for != self._waited_for:
            self._waited_for = waited_for
            self._run.monitor.note(waited_for)
        for line in self._run.monitor.take_lines():
            print(f"{self._elapsed_s():7.1f} s  {line}", flush=True)
        for line in self._run.launcher.greetings:
            if line not in self._greeted:  # they come in any order, and one that is given up goes
                self._greeted.add(line)
                print(line, flush=True)

    def print_vehicles(self) -> None:
        """One line per vehicle of which anything was received."""
        vehicles = self._run.monitor.vehicles
        width = max(map(len, vehicles))
        now_ns = time.monotonic_ns()
        for name, vehicle in vehicles.items():
            if vehicle.is_known:
                print(f"{self._elapsed_s():7.1f} s  {name:<{width}} {vehicle.line(now_ns)}", flush=True)

    def _elapsed_s(self) -> float:
        return time.monotonic() - self._run.started_s

    def _draw(self) -> Group:
        run = self._run
        minutes, seconds = divmod(int(self._elapsed_s()), 60)
        waiting = run.launcher.waiting_for
        status = (f"waiting for {', '.join(waiting)}", _WARN) if waiting else ("running", _GOOD)
        title = Table.grid(expand=True)
        title.add_column(no_wrap=True, overflow="ellipsis")
        title.add_column(justify="right", no_wrap=True)
        title.add_row(
            Text.assemble((run.rig.name, "bold"), "  ", status),
            Text(f"{minutes}:{seconds:02d}", style=_DIM),
        )
        lower = self._lower()
        now_ns = time.monotonic_ns()
        cells = {name: vehicle.rows(now_ns) for name, vehicle in run.monitor.vehicles.items()}
        labels = next(iter(run.monitor.vehicles.values())).labels()
        blocks = math.ceil(len(cells) / _MOST_COLUMNS)
        room = self._console.height - 2 - _AROUND_EVENTS  # beside title and keys
        most = max((room - _LEAST_EVENTS) // blocks - _AROUND_ROWS, _LEAST_ROWS)
        shown_rows = rows_worth_showing(list(cells.values()), most)
        rows = len(shown_rows)
        room -= blocks * (rows + _AROUND_ROWS)
        has_lower = room - self._lower_lines >= _LEAST_EVENTS
        shown = room - self._lower_lines if has_lower else room
        lines = list(run.monitor.lines)[-max(min(shown, _MOST_EVENTS), 1) :]
        events = Text("\n".join(lines) or "starting ...", no_wrap=True, overflow="ellipsis")
        offered = "   ".join([self._keys or "Ctrl-C ends", *run.launcher.greetings])
        keys = Text(offered, style="bold" if self._keys else _DIM, no_wrap=True,
                    overflow="ellipsis")  # fmt: skip
        return Group(
            title,
            *self._vehicles(
                [labels[row] for row in shown_rows],
                {name: [column[row] for row in shown_rows] for name, column in cells.items()},
            ),
            *([lower] if has_lower else []),
            Panel(events, title="events", title_align="left", border_style=_DIM, padding=(0, 1)),
            keys,
        )

    def _vehicles(self, labels: list[str], cells: dict[str, list[Cell]]) -> Iterator[Table]:
        """Tables of vehicles beside each other.

        Args:
            labels: Of the rows.
            cells: Of each vehicle, in the order of the labels.
        """
        widest = _NARROW_LABEL if self._console.width < _NARROW else _WIDEST_LABEL
        label_width = min(max(map(len, labels), default=0), widest)
        names = list(cells)
        for first in range(0, len(names), _MOST_COLUMNS):
            shown = names[first : first + _MOST_COLUMNS]
            table = Table(box=box.SIMPLE_HEAD, expand=True, padding=(0, 1), pad_edge=False)
            table.add_column("", style=_DIM, no_wrap=True, width=label_width)
            for name in shown:
                table.add_column(Text(name, style="bold"), no_wrap=True, ratio=1)
            room = (self._console.width - label_width) // len(shown) - _BETWEEN
            columns = [[text_of(cell, room) for cell in cells[name]] for name in shown]
            for label, *row in zip(labels, *columns, strict=True):
                table.add_row(label, *row)
            yield table

    def _lower(self) -> Segments:
        """Ages, processes and ports, rendered anew only when they change: laying out tables is what costs."""
        run = self._run
        shown = (
            self._console.width,
            tuple(run.monitor.latency.items()),
            tuple((child.name, child.state, child.restarts) for child in run.launcher.children),
            tuple(run.monitor.health.ports.items()),
        )
        if shown != self._lower_shows:
            self._lower_shows = shown
            lower = Table.grid(expand=True, padding=(0, 3))
            lower.add_column()
            lower.add_column()
            lower.add_column(ratio=1)
            lower.add_row(self._ages(), self._processes(), self._ports())
            lines = self._console.render_lines(lower)
            self._lower_lines = len(lines)
            self._rendered = Segments([piece for line in lines for piece in (*line, Segment.line())])
        return self._rendered

    def _ages(self) -> Table:
        table = _small("age of the light, p50 / p99 ms")
        table.add_column("", style=_DIM, no_wrap=True)
        known = dict(list(self._run.monitor.latency.items())[:_MOST_COLUMNS])
        for name in known:
            table.add_column(name, justify="right", no_wrap=True)
        for index, stage in enumerate(STAGES):
            ages = (_ms(row.p50_s[index], row.p99_s[index]) for row in known.values())
            table.add_row(_STAGES[stage], *ages)
        return table

    def _processes(self) -> Table:
        table = _small("processes")
        for heading in ("", "", "again"):
            table.add_column(heading, no_wrap=True)
        for child in self._run.launcher.children:
            style = _GOOD if child.state == "ready" else _WARN
            table.add_row(child.name, Text(child.state, style=style), str(child.restarts or ""))
        return table

    def _ports(self) -> Table:
        table = _small("ports")
        table.add_column("", no_wrap=True)
        table.add_column("", no_wrap=True, overflow="ellipsis")
        for name, report in sorted(self._run.monitor.health.ports.items()):
            if report.level == 0:
                table.add_row(name, Text("open", style=_GOOD))
            else:
                table.add_row(name, Text(report.summary.removeprefix(f"{name}: "), style=_BAD))
        return table


def rows_worth_showing(columns: Sequence[Sequence[Cell]], most: int) -> list[int]:
    """Which rows are shown: all where they find room, else those in which something stands come first.

    Mode and faults always are; a row that nothing is published for gives way to one further down.

    Args:
        columns: Cells of each vehicle.
        most: Rows that there is room for.
    """
    every = range(len(columns[0]))
    if len(every) <= most:
        return list(every)
    filled = [
        row
        for row in every
        if row < _LEAST_ROWS or any(column[row].text.strip() not in _EMPTY for column in columns)
    ]
    return filled[:most]


def text_of(cell: Cell, room: int | None = None) -> Text:
    """A cell in the colours of its levels; what does not fit is cut off.

    Args:
        cell: The cell.
        room: Characters that there are: where they are too few, columns of numbers move together first.
    """
    pieces = [(piece, _STYLES[level]) for piece, level in cell.pieces]
    if room is not None and len(cell.text) > room:
        pieces = [(_SPACES.sub(" ", piece), style) for piece, style in pieces]
        pieces[0] = (pieces[0][0].lstrip(), pieces[0][1])
    return Text.assemble(*pieces, no_wrap=True, overflow="ellipsis")


def _small(title: str) -> Table:
    return Table(
        title=title,
        box=None,
        title_justify="left",
        title_style="bold",
        padding=(0, 2, 0, 0),
        pad_edge=False,
        header_style=_DIM,
    )


def _ms(low_s: float, high_s: float) -> str:
    return "-" if math.isnan(low_s) else f"{low_s * 1e3:.1f} / {high_s * 1e3:.1f}"
