"""What people are shown of the valves: gate, open valves, whose command, the tank, a silent valve node."""

import math
from collections import deque
from collections.abc import Iterator

import numpy as np

from groundstation.control.gas import GasConfig, GasHistory, GasLeft, gas_left
from groundstation.declarations.message import Message
from groundstation.declarations.view import NOTHING, Cell, Gauge, GaugeRow, Level, Newest, cell
from groundstation.parts.operation.messages import Diagnostics
from groundstation.parts.valves.messages import Outlook, ValveCommand, ValveSelection, ValveStatus
from groundstation.supervision.seen_faults import LEAST_TANK_PA

SILENT_S = 3.0
"""So long after the bus was opened a valve node should have reported."""
BUS = "valve_bus"
"""Channel of the bus that all valve nodes share."""
SOON_S = 60.0
"""Later than this nobody wants to know when it would coast over the edge."""
KEPT_ROWS, LONGEST_GAP_S, KNOWN_NS, FEW_MINUTES = 1200, 2.0, 5_000_000_000, 3.0
"""Of the tank: readings kept, one a second; longest hole; how often it is computed; what is little."""
_VALVES = 8
_GATES = {"open": "armed"}
"""Words for people: that a gate lets commands through does not mean that a valve is open."""


class GateGauge(Gauge):
    """Armed state, gate and open valves; reports a valve node from which nothing comes."""

    label = "valves"
    every = (Diagnostics,)
    newest = (ValveCommand, ValveStatus)
    rated = (ValveStatus,)

    def __init__(self, vehicle: str) -> None:
        super().__init__(vehicle)
        self._open_since_ns: int | None = None
        self._is_silent = False

    def take(self, message: Message, now_ns: int) -> Iterator[str]:
        del now_ns
        assert isinstance(message, Diagnostics)
        if message.node == BUS:
            self._open_since_ns = message.stamp_ns if message.level == 0 else None
        yield from ()

    def look(self, newest: Newest, now_ns: int) -> Iterator[str]:
        opened_ns, was_silent = self._open_since_ns, self._is_silent
        comes = newest.rate_hz(ValveStatus, now_ns) > 0.0
        self._is_silent = opened_ns is not None and now_ns - opened_ns > SILENT_S * 1e9 and not comes
        if self._is_silent and not was_silent:
            yield (
                f"{self.vehicle}: nothing comes from its valve node; "
                "while no command reaches it, it keeps its valves closed"
            )
        elif was_silent and comes:
            yield f"{self.vehicle}: its valve node reports"

    def cell(self, newest: Newest, now_ns: int) -> Cell:
        del now_ns
        command, status = newest.get(ValveCommand), newest.get(ValveStatus)
        if command is None:
            return NOTHING
        level = Level.GOOD if command.gate == "open" else Level.WARNING
        shown = cell(f"{_GATES.get(command.gate, command.gate)} ", level)
        if status is None:
            return shown + cell("·" * _VALVES)
        shown += cell("".join("●" if status.open_mask >> valve & 1 else "·" for valve in range(_VALVES)))
        return shown + cell(" dead man", Level.BAD) if status.dead_man else shown

    def phrase(self, newest: Newest, now_ns: int) -> str:
        del now_ns
        command = newest.get(ValveCommand)
        return f"{'-' if command is None else _GATES.get(command.gate, command.gate):<8}"


class SourceGauge(Gauge):
    """Whose command the valves carry out."""

    label = "commanded by"
    newest = (ValveSelection,)

    def cell(self, newest: Newest, now_ns: int) -> Cell:
        del now_ns
        selection = newest.get(ValveSelection)
        if selection is None:
            return NOTHING
        text = selection.source + (f": {selection.reason}" if selection.reason else "")
        return cell(text, Level.WARNING if selection.source in ("closed", "brake") else Level.PLAIN)


class OutlookGauge(Gauge):
    """Way to rest, what is met first, and what the safety filter changes commands for."""

    label = "stops within"
    newest = (Outlook, ValveCommand)

    def cell(self, newest: Newest, now_ns: int) -> Cell:
        del now_ns
        outlook, command = newest.get(Outlook), newest.get(ValveCommand)
        if outlook is None or command is None or command.gate != "open":
            return NOTHING
        shown = f"{1e3 * outlook.stopping_distance_m:.0f} mm"
        if outlook.time_to_edge_s < SOON_S:
            shown += f", edge in {outlook.time_to_edge_s:.0f} s"
        if outlook.nearest:
            shown += f", {outlook.nearest} {1e3 * outlook.nearest_room_m:.0f} mm off"
        if not outlook.limited_by:
            return cell(shown)
        return cell(f"{shown}, held back for: {outlook.limited_by}", Level.WARNING)


class TankGauge(Gauge):
    """Pressure, how long that lasts at the use of late, and whether the float air is on.

    Looks as often as people do: which valves are open then is a sample of how long they are.
    """

    label = "tank"
    newest = (ValveStatus,)

    def __init__(self, vehicle: str) -> None:
        super().__init__(vehicle)
        self._rows: deque[tuple[float, float, float, float]] = deque(maxlen=KEPT_ROWS)
        self._stamp_ns: int | None = None
        self._afloat_s = self._valves_s = 0.0
        self._left: GasLeft | None = None
        self._known_ns = 0

    def look(self, newest: Newest, now_ns: int) -> Iterator[str]:
        status = newest.get(ValveStatus)
        if status is None or status.stamp_ns == self._stamp_ns:
            return
        if self._stamp_ns is not None:
            span_s = min(max(0.0, 1e-9 * (status.stamp_ns - self._stamp_ns)), LONGEST_GAP_S)
            self._afloat_s += span_s * status.floating
            self._valves_s += span_s * status.open_mask.bit_count()
        self._stamp_ns = status.stamp_ns
        stamp_s = 1e-9 * status.stamp_ns
        if not self._rows or stamp_s - self._rows[-1][0] >= 1.0:
            self._rows.append((stamp_s, status.pressure_pa, self._afloat_s, self._valves_s))
        if now_ns - self._known_ns >= KNOWN_NS:
            self._known_ns = now_ns
            columns = np.array(self._rows).reshape(-1, 4).T
            self._left = gas_left(GasHistory(*columns), GasConfig(reserve_pa=LEAST_TANK_PA))
        yield from ()

    def cell(self, newest: Newest, now_ns: int) -> Cell:
        del now_ns
        status = newest.get(ValveStatus)
        if status is None or math.isnan(status.pressure_pa):
            return NOTHING
        shown = f"{status.pressure_pa * 1e-5:.0f} bar"
        if not status.floating:
            return cell(f"{shown}, float air off")
        lasts = None if self._left is None else self._left.steering
        if lasts is None:
            return cell(shown)
        minutes = lasts.span_s / 60.0
        level = Level.WARNING if minutes < FEW_MINUTES else Level.PLAIN
        return cell(f"{shown}, {minutes:.0f} min left, ± {max(1.0, lasts.sigma_s / 60.0):.0f}", level)


GAUGES = (
    GaugeRow(20, GateGauge),
    GaugeRow(30, SourceGauge),
    GaugeRow(35, OutlookGauge),
    GaugeRow(36, TankGauge),
)
