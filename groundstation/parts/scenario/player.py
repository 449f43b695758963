"""Player: carries a timeline out; an operator that never sleeps, in virtual time as live."""

from collections.abc import Iterator, Mapping

from groundstation.declarations.lease import Lease, LeaseCheck
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.declarations.request import Ack, Action, ArgumentError, Request, answer
from groundstation.parts.control.messages import ControlStatus
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.scenario.condition_text import read_condition
from groundstation.parts.scenario.conditions import Bounds, Condition, Known
from groundstation.parts.scenario.messages import ENDED, FAILED, RUNNING, WAITING, Marker, ScenarioStatus
from groundstation.parts.scenario.sections import ScenarioSection, TimelineRow
from groundstation.parts.supervision.messages import Supervision
from groundstation.supervision.modes import Mode

AUTHOR = "scenario"
PERIOD_NS = 20_000_000
STATUS_NS = 200_000_000
PATIENCE_NS = 5_000_000_000
"""An answer that takes longer will not come."""
RESUME = "resume"
START = Action("start_scenario", "player", "begin the scenario that waits for it", is_of_rig=True)
BY_HAND = f"a person's {START.name}"
STARTED_AGAIN = "the player was started again, and a timeline is not carried out twice"


class Player(Node):
    """Waits until all fly and, if started by hand, for a person; then publishes what the timeline asks.

    Args:
        section: The timeline.
        vehicles: All of the rig.
        bounds: Of the table.
    """

    inputs = (Supervision, VehicleState, ControlStatus, Ack, Request, Lease)
    paced = (VehicleState,)
    outputs = (Request, Marker, ScenarioStatus, Ack)

    def __init__(self, section: ScenarioSection, vehicles: tuple[str, ...], bounds: Bounds) -> None:
        super().__init__("", PERIOD_NS)
        self._section = section
        self._bounds = bounds
        self._known: Mapping[str, Known] = {name: Known() for name in vehicles}
        groups = {name: (name,) for name in vehicles}
        self._conditions = {
            row.where: read_condition(row.when, groups, bounds) for row in section.timeline if row.when
        }
        self._lease = LeaseCheck()
        self._was_ready = False
        self._is_asked_for = not section.by_hand
        self._began_ns: int | None = None
        self._zero_ns = 0
        self._state = WAITING
        self._reason = ""
        self._fired: dict[int, int] = {}  # row: when
        self._held: dict[int, int] = {}  # row: since when its condition has held
        self._asked: dict[int, tuple[int, str, TimelineRow]] = {}  # request: when, vehicle, row
        self._requests = 0
        self._published_ns = 0
        self._published: tuple[str, int] | None = None

    def sources(self, payload: type[Message]) -> tuple[str, ...]:
        return ("",) if payload is Request else tuple(self._known)

    def start(self, now_ns: int) -> Iterator[Message]:
        self._began_ns = now_ns
        yield from self._status(now_ns)

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        match message:
            case VehicleState():
                known = self._known[message.vehicle]
                # one that has come late is not news; a stamp of tomorrow is none either
                known.state_ns = min(message.stamp_ns, now_ns) if message.status == "flying" else 0
                known.position_table_m = message.position_table_m
                known.velocity_table_m_s = message.velocity_table_m_s
                known.heading_rad = message.heading_rad
            case ControlStatus():
                known = self._known[message.vehicle]
                known.setpoint_ns = now_ns
                known.setpoint_table_m = message.goal_position_table_m
                known.setpoint_heading_rad = message.goal_heading_rad
            case Supervision():
                known = self._known[message.vehicle]
                if not known.mode and message.is_in_flight:  # at its first sight
                    self._fail(f"{message.vehicle} flew already: {STARTED_AGAIN}")
                known.mode = message.mode
            case Ack() if message.author == AUTHOR:
                self._answered(message)
            case Lease():
                self._lease.take(message)
            case Request() if message.action == START.name:
                yield answer(message, now_ns, self._start(message, now_ns))

    def tick(self, now_ns: int) -> Iterator[Message]:
        for known in self._known.values():
            known.look(now_ns)
        if self._state == WAITING:
            yield from self._begin(now_ns)
        if self._state == RUNNING:
            yield from self._carry_on(now_ns)
        yield from self._status(now_ns)

    # -- until t = 0 ----------------------------------------------------------------------------------

    def _begin(self, now_ns: int) -> Iterator[Message]:
        assert self._began_ns is not None
        missing = self._not_ready(now_ns)
        if not missing and self._is_asked_for:
            self._state, self._zero_ns = RUNNING, now_ns
            for vehicle in self._section.resumed:
                yield self._request(vehicle, RESUME, "{}", _START, now_ns)
        elif not missing:
            self._was_ready = True
        elif not self._was_ready and now_ns - self._began_ns > self._section.ready_s * 1e9:
            self._fail(f"ready_s: {missing} after {self._section.ready_s:g} s")

    def _start(self, request: Request, now_ns: int) -> str:
        """Take a person's start, or say why not."""
        try:
            START.read(request)
        except ArgumentError as error:
            return str(error)
        refusal = self._lease.objection(request, now_ns)
        if refusal:
            return refusal
        if not self._section.by_hand:
            return "the scenario is not started by hand: it begins when all are ready"
        if self._state != WAITING or self._is_asked_for:
            return f"the scenario has been started: it is {self._state}"
        missing = self._not_ready(now_ns)
        self._is_asked_for = not missing
        return missing

    def _not_ready(self, now_ns: int) -> str:
        """Why t = 0 has not come."""
        for name in self._section.starters:
            if self._known[name].mode != Mode.FLYING:
                return f"{name} does not fly"
        if self._section.settle_first:
            for name in self._section.starters:
                if not self._known[name].is_settled(0, now_ns):
                    return f"{name} has not settled at its start"
        return ""

    # -- from t = 0 on --------------------------------------------------------------------------------

    def _carry_on(self, now_ns: int) -> Iterator[Message]:
        for number, row in enumerate(self._section.timeline):
            if number not in self._fired and self._is_due(number, row, now_ns):
                self._fired[number] = now_ns
                if row.mark:
                    yield Marker(now_ns, "", row.mark)
                for vehicle in row.vehicles if row.action else ():
                    yield self._request(vehicle, row.action, row.arguments, row, now_ns)
        for asked_ns, vehicle, row in self._asked.values():
            if now_ns - asked_ns > PATIENCE_NS:
                self._fail(f"{row.where}: nobody answered {vehicle}'s {row.action}")
        if self._state == RUNNING and now_ns - self._zero_ns >= self._section.duration_s * 1e9:
            self._end()

    def _is_due(self, number: int, row: TimelineRow, now_ns: int) -> bool:
        if row.at_s is not None:
            return now_ns - self._zero_ns >= round(row.at_s * 1e9)
        above_ns = self._zero_ns if number == 0 else self._fired.get(number - 1)
        if above_ns is None:
            return False
        held_ns = self._held.get(number)
        if held_ns is None:
            condition: Condition = self._conditions[row.where]
            if condition.holds(self._known, self._bounds, above_ns, now_ns):
                held_ns = self._held[number] = now_ns
            elif row.timeout_s is not None and now_ns - above_ns > row.timeout_s * 1e9:
                self._fail(f"{row.where}: {row.when!r} did not come true within {row.timeout_s:g} s")
        return held_ns is not None and now_ns - held_ns >= round(row.after_s * 1e9)

    def _end(self) -> None:
        """The time is over; what had to happen by then has happened, or the run has failed."""
        missing = [
            row.where for number, row in enumerate(self._section.timeline) if number not in self._fired
        ]
        if missing:
            self._fail(f"{missing[0]}: had not come when the run ended")
        else:
            self._state = ENDED

    def _fail(self, reason: str) -> None:
        if self._state != FAILED:
            self._state, self._reason = FAILED, reason

    # -- requests and answers -------------------------------------------------------------------------

    def _request(self, vehicle: str, action: str, arguments: str, row: TimelineRow, now_ns: int) -> Request:
        self._requests += 1
        self._asked[self._requests] = now_ns, vehicle, row
        return Request(now_ns, vehicle, self._requests, AUTHOR, action, arguments)

    def _answered(self, ack: Ack) -> None:
        found = self._asked.pop(ack.request_id, None)
        if found is None:
            return
        _, vehicle, row = found
        answer = "accepted" if ack.accepted else "refused"
        if row.answer not in ("any", answer):
            because = f": {ack.reason}" if ack.reason else ""
            self._fail(f"{row.where}: {vehicle}'s {ack.action} was {answer}, expected {row.answer}{because}")

    # -- how far it is --------------------------------------------------------------------------------

    def _status(self, now_ns: int) -> Iterator[Message]:
        now = self._state, len(self._fired)
        if now == self._published and now_ns - self._published_ns < STATUS_NS:
            return
        self._published, self._published_ns = now, now_ns
        yield ScenarioStatus(
            now_ns,
            "",
            self._section.name,
            self._state,
            self._zero_ns,
            len(self._fired),
            self._waits_for(now_ns),
            self._reason,
        )

    def _waits_for(self, now_ns: int) -> str:
        if self._state == WAITING:
            return self._not_ready(now_ns) or ("" if self._is_asked_for else BY_HAND)
        waiting = (
            row.when
            for number, row in enumerate(self._section.timeline)
            if row.when and number not in self._held and (number == 0 or number - 1 in self._fired)
        )
        return next(waiting, "") if self._state == RUNNING else ""


_START = TimelineRow(where="start", at_s=0.0)
"""Stands for the beginning, where controllers are asked to begin their programs."""
