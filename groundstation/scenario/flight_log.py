"""What a run's quantities are made from: rows of numbers for each vehicle, gathered as messages come."""

import json
import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from groundstation.bus.envelope import Delivered
from groundstation.declarations.message import Message
from groundstation.declarations.request import Ack, Request
from groundstation.parts.control.actions import GO_TO
from groundstation.parts.control.controller_node import RESUME
from groundstation.parts.control.messages import ControlStatus
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.laboratory.messages import InjectedFailure
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.scenario.messages import WAITING, Marker, ScenarioStatus
from groundstation.parts.supervision.messages import Faults, Supervision
from groundstation.parts.valves.messages import ValveCommand
from groundstation.parts.valves.pulses import open_s
from groundstation.watch.verdict import RunEvent

Array = NDArray[np.float64]
LOGGED: tuple[type[Message], ...] = (
    ReferenceState, VehicleState, ControlStatus, ValveCommand, Supervision, Faults, Request, Ack,
    InjectedFailure, Marker, ScenarioStatus,
)  # fmt: skip
"""Classes that a log takes; others may be given."""
_LOGGED = frozenset(LOGGED)


@dataclass(slots=True)
class VehicleRows:
    """What was gathered of one vehicle; stamps in ns, on the clock of the run.

    Attributes:
        truth: Stamp, x, y (m), heading (rad), velocity x, y (m/s), by the reference system.
        state: The same by the estimate, while it is flown on.
        setpoint: Stamp, x, y, heading.
        commands: Stamp, on-time of each valve (ms).
        goals: Stamp, x, y, heading of each accepted `go_to`; NaN from where a program goes on.
        mode: Of the supervisor, the newest.
        faults: What stands now.
    """

    truth: list[tuple[float, ...]] = field(default_factory=list)
    state: list[tuple[float, ...]] = field(default_factory=list)
    setpoint: list[tuple[float, ...]] = field(default_factory=list)
    commands: list[tuple[int, bytes]] = field(default_factory=list)
    goals: list[tuple[float, ...]] = field(default_factory=list)
    mode: str = ""
    faults: frozenset[str] = frozenset()


class FlightLog:
    """Gathers; give it every message of ``LOGGED`` in the order of publication.

    Attributes:
        vehicles: Rows by vehicle.
        status: The newest of the player.
        zero_ns: Stamp of t = 0; None before.
        was_started_again: The player died in flight: it forgot what it had asked.
    """

    def __init__(self, vehicles: tuple[str, ...]) -> None:
        self.vehicles = {name: VehicleRows() for name in vehicles}
        self.status: ScenarioStatus | None = None
        self.zero_ns: int | None = None
        self.was_started_again = False
        self.last_ns = 0
        self._events: list[tuple[int, str, str, str]] = []
        self._asked: dict[tuple[str, int], Request] = {}

    def observe(self, delivered: Delivered, now_ns: int) -> None:
        """Take a message as a runner's observer does."""
        self.take(delivered.payload, now_ns)

    def take(self, message: Message, now_ns: int) -> None:
        """Take a message that was published at a moment."""
        self.last_ns = now_ns
        if type(message) not in _LOGGED:
            return
        if isinstance(message, ScenarioStatus):
            before = self.status.state if self.status is not None else WAITING
            self.was_started_again |= before != WAITING and message.state == WAITING
            self.status = message
            if message.zero_ns:
                self.zero_ns = message.zero_ns
        elif isinstance(message, Marker):
            self._events.append((now_ns, "marker", "", message.text))
        else:
            rows = self.vehicles.get(message.vehicle)
            if rows is not None:
                self._of_vehicle(rows, message, now_ns)

    def _of_vehicle(self, rows: VehicleRows, message: Message, now_ns: int) -> None:
        match message:
            case ReferenceState():
                pose = (*message.position_table_m, message.heading_rad, *message.velocity_table_m_s)
                rows.truth.append((message.stamp_ns, *pose))
            case VehicleState() if message.status == "flying":
                pose = (*message.position_table_m, message.heading_rad, *message.velocity_table_m_s)
                rows.state.append((message.stamp_ns, *pose))
            case ControlStatus():
                goal = (*message.goal_position_table_m, message.goal_heading_rad)
                rows.setpoint.append((message.stamp_ns, *goal))
            case ValveCommand():
                rows.commands.append((message.stamp_ns, bytes(message.on_time_ms)))
            case Supervision():
                if message.mode != rows.mode:
                    rows.mode = message.mode
                    self._events.append((now_ns, "mode", message.vehicle, f"{message.mode}: {message.cause}"))
            case Faults():
                self._faults(rows, message, now_ns)
            case InjectedFailure() if not message.refusal:
                ends = "" if message.is_active else " ends"
                self._events.append((now_ns, "failure", message.vehicle, f"{message.failure}{ends}"))
            case Request():
                self._asked[message.author, message.request_id] = message
            case Ack():
                self._answered(rows, message, now_ns)

    def _faults(self, rows: VehicleRows, message: Faults, now_ns: int) -> None:
        there = frozenset(
            fault for fault, gone_ns in zip(message.ids, message.gone_ns, strict=True) if not gone_ns
        )
        for fault in sorted(there - rows.faults):
            detail = message.details[message.ids.index(fault)]
            self._events.append((now_ns, "fault", message.vehicle, f"{fault}: {detail}" if detail else fault))
        for fault in sorted(rows.faults - there):
            self._events.append((now_ns, "fault", message.vehicle, f"{fault} ends"))
        rows.faults = there

    def _answered(self, rows: VehicleRows, ack: Ack, now_ns: int) -> None:
        request = self._asked.pop((ack.author, ack.request_id), None)
        words = "accepted" if ack.accepted else f"refused: {ack.reason}"
        self._events.append((now_ns, "request", ack.vehicle, f"{ack.action} {words}"))
        if request is None or not ack.accepted:
            return
        if ack.action == GO_TO.name:
            given = json.loads(request.arguments)
            rows.goals.append((now_ns, given["x_m"], given["y_m"], given["heading_rad"]))
        elif ack.action == RESUME:
            rows.goals.append((now_ns, math.nan, math.nan, math.nan))

    def events(self) -> tuple[RunEvent, ...]:
        """What happened, in order; times count from t = 0, or from the start where that never came."""
        zero_ns = self.zero_ns or 0
        return tuple(
            RunEvent((stamp_ns - zero_ns) * 1e-9, kind, vehicle, text)
            for stamp_ns, kind, vehicle, text in self._events
        )

    def tracks(self) -> dict[str, "VehicleTrack"]:
        """The rows as arrays, times in s from t = 0."""
        zero_ns = self.zero_ns or 0
        return {name: _track(rows, zero_ns) for name, rows in self.vehicles.items()}


@dataclass(frozen=True, slots=True, eq=False)
class VehicleTrack:
    """Arrays of one vehicle; the first column is t (s) from t = 0, metres, radians.

    Attributes:
        truth: t, x, y, heading (unwrapped), velocity x, y; the estimate where there is no reference system.
        state: Likewise, the estimate.
        setpoint: t, x, y, heading.
        open_valves: t of each command, seconds that all valves together are open until the next.
        goals: t, x, y, heading.
        has_truth: Whether ``truth`` is one.
    """

    truth: Array
    state: Array
    setpoint: Array
    open_valves: Array
    goals: Array
    has_truth: bool


def _track(rows: VehicleRows, zero_ns: int) -> VehicleTrack:
    state = _array(rows.state, 6, zero_ns)
    truth = _array(rows.truth, 6, zero_ns)
    has_truth = len(truth) > 0
    if not has_truth:
        truth = state.copy()
    if len(truth):
        truth[:, 3] = np.unwrap(truth[:, 3])
    return VehicleTrack(
        truth,
        state,
        _array(rows.setpoint, 4, zero_ns),
        _open_valves(rows.commands, zero_ns),
        _array(rows.goals, 4, zero_ns),
        has_truth,
    )


def _array(rows: list[tuple[float, ...]], columns: int, zero_ns: int) -> Array:
    """Rows of numbers; stamps are subtracted as whole numbers, floats would round them."""
    if not rows:
        return np.empty((0, columns))
    stamps = np.array([int(row[0]) - zero_ns for row in rows], np.int64)
    values = np.array([row[1:] for row in rows], float).reshape(len(rows), columns - 1)
    return np.column_stack([stamps * 1e-9, values])


def _open_valves(commands: list[tuple[int, bytes]], zero_ns: int) -> Array:
    if not commands:
        return np.empty((0, 2))
    t_s = np.array([1e-9 * (stamp_ns - zero_ns) for stamp_ns, _ in commands], np.float64)
    on_time_ms = np.frombuffer(b"".join(on for _, on in commands), np.uint8).reshape(len(commands), -1)
    on_time_s = 1e-3 * on_time_ms.astype(np.float64)
    return np.column_stack([t_s, open_s(t_s, on_time_s).sum(axis=1)])


def within(rows: Array, from_s: float, to_s: float) -> Array:
    """Rows of a span; both ends belong to it."""
    found: Array = rows[(rows[:, 0] >= from_s) & (rows[:, 0] <= to_s)]
    return found
