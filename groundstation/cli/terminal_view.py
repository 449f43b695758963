"""What ``groundstation run`` shows: mock-ups, errors against truth, rates, ledger, processes, tidings."""

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.columns import Columns
from rich.console import Console, Group
from rich.live import Live
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from groundstation.messages import definitions as m
from groundstation.runtime.live_run import LiveRun
from groundstation.runtime.monitor import VehicleMonitor

_GOOD, _BAD, _DIM = "green", "red", "dim"


class TerminalView:
    """Draws a live run with rich, or writes it as lines."""

    def __init__(self, live: LiveRun, console: Console) -> None:
        self._run = live
        self._console = console
        self._live: Live | None = None
        self._said = 0

    @contextmanager
    def opened(self, *, headless: bool) -> Iterator[None]:
        """Keep the screen while the run lasts."""
        if headless:
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

    def print_lines(self) -> None:
        """New tidings, then one line per vehicle."""
        monitor = self._run.monitor
        elapsed = f"{time.monotonic() - self._run.started_s:7.1f} s"
        for line in monitor.take_lines():
            print(f"{elapsed}  {line}", flush=True)
        for name, vehicle in monitor.vehicles.items():
            print(f"{elapsed}  {name}: {_line(vehicle)}", flush=True)

    def _draw(self) -> Group:
        run = self._run
        elapsed = time.monotonic() - run.started_s
        title = Text.assemble((run.rig.name, "bold"), f"   {elapsed:.0f} s   ", ("Ctrl-C ends", _DIM))
        tidings = Text("\n".join(run.monitor.lines) or "starting ...")
        return Group(
            title,
            self._vehicles(),
            Columns([self._ledger(), self._processes()]),
            Panel(tidings, title="tidings", title_align="left", border_style=_DIM),
        )

    def _vehicles(self) -> Table:
        table = Table(title="mock-ups", title_justify="left", expand=True)
        headings = (
            "", "phase", "valves", "position mm", "heading deg", "off goal mm, deg (rms 30 s)",
            "estimate error mm, deg (rms)", "imu, fix, state Hz", "fix age s", "fixes used/refused",
            "lost frames", "tank bar",
        )  # fmt: skip
        for heading in headings:
            table.add_column(heading, justify="right" if heading else "left")
        now_ns = time.monotonic_ns()
        for name, vehicle in self._run.monitor.vehicles.items():
            table.add_row(name, *_cells(vehicle, now_ns))
        return table

    def _ledger(self) -> Table:
        table = Table(title="age of light, and bytes to state: p50 / p99 ms", title_justify="left")
        table.add_column("")
        rows = {name: vehicle.newest.get(m.Latency) for name, vehicle in self._run.monitor.vehicles.items()}
        known = {name: row for name, row in rows.items() if isinstance(row, m.Latency)}
        stages = next(iter(known.values())).stages if known else ()
        for stage in stages:
            table.add_column(stage.replace("_", " "), justify="right")
        for name, row in known.items():
            cells = [_ms(low, high) for low, high in zip(row.p50_s, row.p99_s, strict=True)]
            table.add_row(name, *cells)
        return table

    def _processes(self) -> Table:
        table = Table(title="processes", title_justify="left")
        for heading in ("process", "state", "restarts"):
            table.add_column(heading)
        for child in self._run.launcher.children:
            style = _GOOD if child.state == "ready" else _BAD
            table.add_row(child.name, Text(child.state, style=style), str(child.restarts or ""))
        return table


def _cells(vehicle: VehicleMonitor, now_ns: int) -> list[str | Text]:
    newest = vehicle.newest
    phase, mode, state = newest.get(m.SequencePhase), newest.get(m.VehicleMode), newest.get(m.VehicleState)
    command, fusion = newest.get(m.ValveCommand), newest.get(m.FusionStatus)
    imu, valves = newest.get(m.Imu), newest.get(m.ValveStatus)
    armed = isinstance(mode, m.VehicleMode) and mode.armed
    gate = command.gate if isinstance(command, m.ValveCommand) else "no word"
    cells: list[str | Text] = [
        Text(phase.phase if isinstance(phase, m.SequencePhase) else "-"),
        Text(f"{'armed' if armed else 'disarmed'}, {gate}", style=_GOOD if gate == "open" else _BAD),
    ]
    if isinstance(state, m.VehicleState):
        x, y = state.position_table_m
        cells += [f"{x * 1e3:8.1f} {y * 1e3:8.1f}", f"{math.degrees(state.heading_rad):7.2f}"]
    else:
        cells += ["-", "-"]
    cells += [_pair(vehicle.station_errors.rms()), _pair(vehicle.estimate_errors.rms())]
    rates = "  ".join(f"{vehicle.rate_hz(kind, now_ns):.0f}" for kind in (m.Imu, m.StarFix, m.VehicleState))
    cells.append(rates)
    if isinstance(fusion, m.FusionStatus):
        cells += [f"{fusion.fix_age_s:.2f}", f"{fusion.fixes_used}/{fusion.fixes_refused}"]
    else:
        cells += ["-", "-"]
    cells.append(str(imu.frames_lost) if isinstance(imu, m.Imu) else "-")
    cells.append(f"{valves.pressure_pa * 1e-5:.0f}" if isinstance(valves, m.ValveStatus) else "-")
    return cells


def _line(vehicle: VehicleMonitor) -> str:
    """One line for a log."""
    now_ns = time.monotonic_ns()
    cells = [str(cell).strip() for cell in _cells(vehicle, now_ns)]
    phase, gate, position, heading, off, estimate, rates, age, fixes, lost, tank = cells
    return (
        f"{phase}; valves {gate}; at {position} mm, {heading} deg; off goal {off} mm deg; "
        f"estimate error {estimate} mm deg; imu, fix, state {rates} Hz; fix age {age} s; "
        f"fixes used/refused {fixes}; lost frames {lost}; tank {tank} bar"
    )


def _pair(rms: tuple[float, float]) -> str:
    position_m, heading_rad = rms
    if math.isnan(position_m):
        return "-"
    return f"{position_m * 1e3:.2f}  {math.degrees(heading_rad):.3f}"


def _ms(low_s: float, high_s: float) -> str:
    return "-" if math.isnan(low_s) else f"{low_s * 1e3:.1f} / {high_s * 1e3:.1f}"
