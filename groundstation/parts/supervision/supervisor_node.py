"""Supervisor: the shell around one vehicle's state machine (``groundstation.supervision``)."""

from collections.abc import Iterator, Mapping

from groundstation.control.edge import braking_to_count_on
from groundstation.control.valve_health import health_of
from groundstation.control.vehicle import VehicleModel
from groundstation.control.wrench_envelope import WrenchEnvelope
from groundstation.declarations.lease import FREE_FOR_ALL, Lease, LeaseCheck
from groundstation.declarations.message import Message
from groundstation.declarations.names import RECORDER
from groundstation.declarations.node import Node
from groundstation.declarations.request import Ack, ArgumentError, Request, answer, shown_name
from groundstation.parts.control.messages import ControlStatus, Wrench
from groundstation.parts.fusion.messages import FusionStatus, VehicleState, control_state
from groundstation.parts.operation.messages import Diagnostics, RecorderStatus
from groundstation.parts.relative_navigation.messages import LeaderState
from groundstation.parts.supervision.actions import ACTIONS
from groundstation.parts.supervision.memory import memory_of
from groundstation.parts.supervision.messages import (
    Faults,
    Findings,
    Recalled,
    StopPress,
    Supervision,
    ValveShares,
)
from groundstation.parts.valves.messages import OutsideControl, ValveStatus
from groundstation.supervision.modes import Event
from groundstation.supervision.sightings import NodeSeen, Seen
from groundstation.supervision.supervisor import Ruling, Supervisor

PERIOD_NS = 20_000_000
REPEAT_NS = 100_000_000
_ALSO_OF_THE_RIG = (StopPress, Diagnostics)
"""The recorder reports for all vehicles."""


class SupervisorNode(Node):
    """Publishes the ruling at once when it changes, and ten times a second.

    Args:
        vehicle: Its name.
        model: Its mass and valves.
        supervisor: A fresh one.
        others: Names of the other vehicles.
        known: Names of all actions; it refuses what none of them is.
        absent: Those of them that no node answers here, and why; it refuses these, too.
    """

    inputs: tuple[type[Message], ...] = (
        StopPress, Request, Lease, Recalled, VehicleState, FusionStatus, ValveStatus, ValveShares, Wrench,
        ControlStatus, Findings, RecorderStatus, Diagnostics, OutsideControl,
    )  # fmt: skip
    paced = (VehicleState,)
    outputs = (Supervision, Faults, Ack)

    def __init__(
        self,
        vehicle: str,
        model: VehicleModel,
        supervisor: Supervisor,
        others: tuple[str, ...],
        known: frozenset[str],
        absent: Mapping[str, str],
    ) -> None:
        super().__init__(vehicle, PERIOD_NS)
        if supervisor.sightings.seen_leader:
            self.inputs = (*self.inputs, LeaderState)
        self._model = model
        self._supervisor = supervisor
        self._others = others
        self._known = known
        self._absent = absent
        self._lease = LeaseCheck()
        self._fixes = (0, 0)  # used and refused, when they were reported last
        self._published: Ruling | None = None
        self._published_ns = 0

    def sources(self, payload: type[Message]) -> tuple[str, ...]:
        if payload is VehicleState:
            return (self.vehicle, *self._others)
        return (self.vehicle, "") if payload in _ALSO_OF_THE_RIG else (self.vehicle,)

    def start(self, now_ns: int) -> Iterator[Message]:
        self._supervisor.sightings.began_ns = now_ns  # and no ruling before it has remembered
        return iter(())

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        match message:
            case StopPress():
                self._supervisor.press(shown_name(message.author), message.press_id, now_ns)
                yield from self._rule(now_ns)
            case Request() if self._answers(message.action):
                reason = self._carry_out(message, now_ns)
                yield from self._rule(now_ns)  # first: what is answered has been kept
                yield answer(message, now_ns, reason)
            case Lease():
                self._lease.take(message)
            case Recalled():
                memory = memory_of(message)
                if memory is not None:
                    self._supervisor.recall(memory, now_ns)
                    yield from self._rule(now_ns)
            case _:
                self._see(message, now_ns)

    def tick(self, now_ns: int) -> Iterator[Message]:
        is_first = self._published is None
        has_changed = self._supervisor.look(now_ns)
        yield from self._rule(now_ns)
        if has_changed or is_first:
            yield self._faults(now_ns)

    def _see(self, message: Message, now_ns: int) -> None:
        sightings = self._supervisor.sightings
        match message:
            case VehicleState():
                seen = _seen(message, now_ns)
                if message.vehicle != self.vehicle:
                    sightings.others[message.vehicle] = seen
                else:
                    sightings.see_own(seen)
            case LeaderState():
                sightings.leader_seen_ns = now_ns
            case FusionStatus():
                sightings.rest_s, sightings.fix_age_s = message.rest_s, message.fix_age_s
                self._count_fixes(message)
            case ValveStatus():
                sightings.node = NodeSeen(
                    min(now_ns, message.stamp_ns),
                    message.armed,
                    message.floating,
                    message.dead_man,
                    message.pressure_pa,
                    message.faults,
                    message.bus_rate_hz,
                )
            case Wrench():
                sightings.demand_ns = now_ns
            case ControlStatus():  # it may be changed to another law
                sightings.neighbours = message.neighbours
            case Diagnostics() if message.level and message.node == f"{self.vehicle}/memory":
                sightings.memory_trouble, sightings.memory_ns = message.summary, now_ns
            case Diagnostics() if message.node == RECORDER:
                sightings.recorder_trouble = message.summary if message.level else ""
            case ValveShares():
                envelope = WrenchEnvelope(self._model, health_of(message.open_ratio, message.shut_ratio))
                sightings.braking_m_s2 = braking_to_count_on(self._model, envelope)
                sightings.missing_thrust = envelope.missing
            case OutsideControl():
                sightings.outside_trouble = f"{message.author}: {message.reason}" if message.is_silent else ""
            case Findings():
                sightings.findings = dict(zip(message.ids, message.details, strict=True))
                sightings.findings_ns = now_ns
            case RecorderStatus():
                sightings.recorder_ns, sightings.recorder_room_s = now_ns, message.room_s

    def _count_fixes(self, status: FusionStatus) -> None:
        used, refused = self._fixes
        self._fixes = status.fixes_used, status.fixes_refused
        if status.fixes_refused != refused or status.fixes_used < used:
            self._supervisor.sightings.agreeing = 0
        else:
            self._supervisor.sightings.agreeing += status.fixes_used - used

    def _answers(self, action: str) -> bool:
        return action in ACTIONS or action in self._absent or action not in self._known

    def _carry_out(self, request: Request, now_ns: int) -> str:
        """Do what was asked; the reason if it cannot be done."""
        refusal = self._lease.objection(request, now_ns)
        if refusal:
            return refusal
        if request.action in self._absent:
            return self._absent[request.action]
        if request.action not in ACTIONS:
            return f"unknown action '{request.action}' (known: {', '.join(sorted(self._known))})"
        author = shown_name(request.author)
        if request.action == Event.STOP:
            self._supervisor.press(author, request.request_id, now_ns)
            return ""
        override = ""
        if request.action not in FREE_FOR_ALL:  # those are never refused for how they are asked
            try:
                given = ACTIONS[request.action].read(request)
            except ArgumentError as error:
                return str(error)
            override = str(given.get("override", ""))
        return self._supervisor.request(Event(request.action), author, now_ns, override)

    def _rule(self, now_ns: int) -> Iterator[Message]:
        ruling = self._supervisor.ruling()
        if ruling == self._published and now_ns - self._published_ns < REPEAT_NS:
            return
        self._published, self._published_ns = ruling, now_ns
        memory = ruling.memory
        yield Supervision(
            now_ns,
            self.vehicle,
            memory.mode,
            ruling.law,
            ruling.may_open,
            ruling.is_air_on,
            memory.is_stop_latched,
            ruling.grace_s,
            memory.is_flight_wanted,
            int(memory.then),
            memory.cause,
            memory.author,
            memory.since_ns,
            ruling.waits_for,
            memory.latched,
        )

    def _faults(self, now_ns: int) -> Faults:
        rows = tuple(self._supervisor.board)
        return Faults(
            now_ns,
            self.vehicle,
            tuple(row.fault.id for row in rows),
            tuple(row.fault.what for row in rows),
            tuple(row.detail for row in rows),
            tuple(float(row.since_ns) for row in rows),
            tuple(row.response.words for row in rows),
            tuple(row.fault.advice for row in rows),
            tuple(0.0 if row.is_there else float(row.seen_ns) for row in rows),
        )


def _seen(message: VehicleState, now_ns: int) -> Seen:
    return Seen(now_ns, control_state(message), message.status, message.pose_sigma)
