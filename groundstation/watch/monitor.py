"""What a person wants to know of a running rig: newest values, rates, errors against truth, counters.

The monitor takes every message, live or in lockstep, and makes the latency ledger's summaries. It
publishes nothing and decides nothing.
"""

import math
from collections import deque
from dataclasses import dataclass, field

from groundstation.bus.envelope import Delivered
from groundstation.frames import wrap_angle
from groundstation.messages import definitions as m
from groundstation.messages.base import Message
from groundstation.runtime import ledger

ERROR_WINDOW_S = 30.0
RATE_WINDOW_S = 3.0
LINES_KEPT = 8
NIS_KEPT = 30


@dataclass(slots=True)
class Rate:
    """Messages per second of one topic over the last seconds."""

    _stamps: deque[int] = field(default_factory=deque)

    def count(self, now_ns: int) -> None:
        """One more."""
        self._stamps.append(now_ns)
        while now_ns - self._stamps[0] > RATE_WINDOW_S * 1e9:
            self._stamps.popleft()

    def hz(self, now_ns: int) -> float:
        """The rate; 0 when silent."""
        while self._stamps and now_ns - self._stamps[0] > RATE_WINDOW_S * 1e9:
            self._stamps.popleft()
        return len(self._stamps) / RATE_WINDOW_S


@dataclass(slots=True)
class Errors:
    """Distances of the last seconds between two poses: (stamp, position in m, heading in rad)."""

    _samples: deque[tuple[int, float, float]] = field(default_factory=deque)

    def add(self, now_ns: int, position_m: float, heading_rad: float) -> None:
        """Take one comparison."""
        self._samples.append((now_ns, position_m, heading_rad))
        while now_ns - self._samples[0][0] > ERROR_WINDOW_S * 1e9:
            self._samples.popleft()

    def rms(self) -> tuple[float, float]:
        """RMS of position (m) and heading (rad) over the window; NaN when empty."""
        count = len(self._samples)
        if not count:
            return math.nan, math.nan
        position = math.sqrt(sum(p * p for _, p, _ in self._samples) / count)
        heading = math.sqrt(sum(h * h for _, _, h in self._samples) / count)
        return position, heading


@dataclass(slots=True)
class VehicleMonitor:
    """Everything known about one vehicle."""

    newest: dict[type[Message], Message] = field(default_factory=dict)
    rates: dict[type[Message], Rate] = field(default_factory=dict)
    estimate_errors: Errors = field(default_factory=Errors)
    """Estimate against truth."""
    station_errors: Errors = field(default_factory=Errors)
    """Truth against goal."""
    refused: dict[str, int] = field(default_factory=dict)
    """Fixes refused, by the kind of reason (what stands before the colon)."""
    verdict: str = ""
    """What the referee of two sources of fixes said last."""
    unused: dict[str, int] = field(default_factory=dict)
    """Fixes that fusion did not use, by reason."""
    nis: deque[float] = field(default_factory=lambda: deque(maxlen=NIS_KEPT))
    """Normalised innovations squared of the newest used fixes."""

    def rate_hz(self, payload: type[Message], now_ns: int) -> float:
        """Messages per second of a topic."""
        rate = self.rates.get(payload)
        return rate.hz(now_ns) if rate is not None else 0.0


_RATED: tuple[type[Message], ...] = (m.Imu, m.StarFix, m.VehicleState, m.ValveCommand, m.ValveStatus)
_SOON_AGAIN = "; next try in "  # what differs from one failure of a port to its next
SILENT_S = 3.0
_CONSEQUENCE = {
    "died": ", no longer used",
    "moved": ", no longer used",
    "revived": ", used again",
    "returned": ", used again",
    "appeared": ", proposed for the catalogue",
    "vanished": ", no longer proposed",
}


@dataclass(slots=True)
class _Line:
    """What the IMU reader counted on one serial line, and whether it was complained about."""

    bytes_seen: int = 0
    grows: bool = False
    is_bad: bool = False


class Monitor:
    """Takes messages, answers questions."""

    def __init__(self, vehicles: tuple[str, ...]) -> None:
        self.vehicles = {name: VehicleMonitor() for name in vehicles}
        self.ledger = ledger.Ledger()
        self.ports: dict[str, m.Diagnostics] = {}
        self.nodes: dict[str, m.Diagnostics] = {}
        self._lines_of: dict[str, _Line] = {}
        self._silent_nodes: set[str] = set()
        self.lines: deque[str] = deque(maxlen=LINES_KEPT)
        self._unread: list[str] = []

    def take(self, delivered: Delivered, now_ns: int) -> None:
        """Account for one message."""
        payload = delivered.payload
        if isinstance(payload, m.Diagnostics):
            self._diagnostics(payload)
            return
        vehicle = self.vehicles.get(payload.vehicle)
        if vehicle is None:
            return
        kind = type(payload)
        if kind in ledger.HEARD:
            self.ledger.take(delivered)
        vehicle.newest[kind] = payload
        if kind in _RATED:
            vehicle.rates.setdefault(kind, Rate()).count(now_ns)
        if isinstance(payload, m.ReferenceState):
            self._compare(vehicle, payload, now_ns)
        elif isinstance(payload, m.FixAccount):
            if not payload.used:
                vehicle.unused[payload.reason] = vehicle.unused.get(payload.reason, 0) + 1
            elif math.isfinite(payload.nis):
                vehicle.nis.append(payload.nis)
        elif isinstance(payload, m.StarFix) and not payload.fix:
            kind_of_refusal = payload.reason.partition(":")[0]
            vehicle.refused[kind_of_refusal] = vehicle.refused.get(kind_of_refusal, 0) + 1
        elif isinstance(payload, m.SequencePhase):
            self.say(
                f"{payload.vehicle}: {payload.phase}" + (f" ({payload.detail})" if payload.detail else "")
            )
        elif isinstance(payload, m.FixComparison):
            self._referee(vehicle, payload)
        elif isinstance(payload, m.SkyChange):
            star = f"star {payload.star}" if payload.star else "a light that is no star"
            self.say(
                f"{payload.vehicle}: {star} {payload.change} at ({payload.x_m:.3f}, {payload.y_m:.3f}) m"
                f"{_CONSEQUENCE.get(payload.change, '')}"
            )
        elif isinstance(payload, m.Ack) and not payload.accepted:
            self.say(f"{payload.vehicle}: {payload.action} refused: {payload.reason}")

    def say(self, line: str) -> None:
        """Keep a line for people; the newest few are shown."""
        self.lines.append(line)
        self._unread.append(line)

    def take_lines(self) -> list[str]:
        """Lines since the last call, for a log."""
        lines, self._unread = self._unread, []
        return lines

    def look(self, now_ns: int) -> None:
        """Say what is open and yet silent, or full of noise; call about once a second."""
        for name, vehicle in self.vehicles.items():
            port = self.ports.get(f"{name}/imu")
            line = self._lines_of.setdefault(name, _Line())
            is_bad = (
                port is not None
                and port.level == 0
                and now_ns - port.stamp_ns > SILENT_S * 1e9
                and vehicle.rate_hz(m.Imu, now_ns) == 0.0
            )
            if is_bad and not line.is_bad:
                what = (
                    "noise and no frame: another baud rate, or another device?"
                    if line.grows
                    else "open, but no byte comes: is the block switched on?"
                )
                self.say(f"{name}/imu: {what} Listening on")
            elif line.is_bad and not is_bad:
                self.say(f"{name}/imu: samples come")
            line.is_bad = is_bad
            self._look_at_valves(name, vehicle, now_ns)

    def _look_at_valves(self, name: str, vehicle: VehicleMonitor, now_ns: int) -> None:
        bus = self.ports.get("valve_bus")
        is_silent = (
            bus is not None
            and bus.level == 0
            and now_ns - bus.stamp_ns > SILENT_S * 1e9
            and vehicle.rate_hz(m.ValveStatus, now_ns) == 0.0
        )
        if is_silent and name not in self._silent_nodes:
            self._silent_nodes.add(name)
            self.say(f"{name}: its valve node says nothing; without word from us it keeps its valves closed")
        elif not is_silent and name in self._silent_nodes:
            self._silent_nodes.discard(name)
            self.say(f"{name}: its valve node speaks")

    def _referee(self, vehicle: VehicleMonitor, payload: m.FixComparison) -> None:
        """Say when two sources of fixes begin to disagree, and when they agree again."""
        if payload.verdict != vehicle.verdict and "disagree" in (payload.verdict, vehicle.verdict):
            says = f"{payload.verdict}: {payload.reason}" if payload.reason else payload.verdict
            self.say(f"{payload.vehicle}: star fixes and overhead fixes {says}")
        vehicle.verdict = payload.verdict

    def _diagnostics(self, payload: m.Diagnostics) -> None:
        is_port = bool(payload.summary) and not payload.keys
        known = self.ports if is_port else self.nodes
        before = known.get(payload.node)
        known[payload.node] = payload
        counters = dict(zip(payload.keys, payload.values, strict=False))
        if "bytes_seen" in counters:
            line = self._lines_of.setdefault(payload.node.partition("/")[0], _Line())
            seen = int(counters["bytes_seen"])
            line.bytes_seen, line.grows = seen, seen > line.bytes_seen
        said = payload.summary.partition(_SOON_AGAIN)[0]
        is_news = before is None or before.summary.partition(_SOON_AGAIN)[0] != said
        if said and (is_news or (is_port and payload.level == 0)):  # an opened port is always news
            self.say(payload.summary)

    @staticmethod
    def _compare(vehicle: VehicleMonitor, truth: m.ReferenceState, now_ns: int) -> None:
        state = vehicle.newest.get(m.VehicleState)
        if isinstance(state, m.VehicleState) and state.status == "flying":
            age_s = (truth.stamp_ns - state.stamp_ns) * 1e-9
            dx = state.position_table_m[0] + state.velocity_table_m_s[0] * age_s - truth.position_table_m[0]
            dy = state.position_table_m[1] + state.velocity_table_m_s[1] * age_s - truth.position_table_m[1]
            turn = wrap_angle(state.heading_rad + state.rate_rad_s * age_s - truth.heading_rad)
            vehicle.estimate_errors.add(now_ns, math.hypot(dx, dy), turn)
        goal = vehicle.newest.get(m.ControlStatus)
        phase = vehicle.newest.get(m.SequencePhase)
        if (
            isinstance(goal, m.ControlStatus)
            and isinstance(phase, m.SequencePhase)
            and phase.phase == "flying"
        ):
            dx = goal.goal_position_table_m[0] - truth.position_table_m[0]
            dy = goal.goal_position_table_m[1] - truth.position_table_m[1]
            turn = wrap_angle(goal.goal_heading_rad - truth.heading_rad)
            vehicle.station_errors.add(now_ns, math.hypot(dx, dy), turn)
