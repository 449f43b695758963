"""One vehicle's supervisor: what is seen becomes faults, faults and requests move the state machine. Pure."""

from dataclasses import dataclass, replace

from drivers.quick_record import quickly_made
from groundstation.supervision.arming import Question, objections
from groundstation.supervision.fault_board import FaultBoard, Standing
from groundstation.supervision.faults import Clears, Response
from groundstation.supervision.mode_machine import GRACE_S, Memory, ModeMachine, Then
from groundstation.supervision.modes import ALOFT, BRAKEABLE, GROUNDED, GUARANTEES, Air, Event, Law, Mode
from groundstation.supervision.seen_faults import faults_seen
from groundstation.supervision.sightings import Sightings

LIFT_S = 0.3
"""From the report that the float air is on until the bearings carry."""
RESTARTED = "commands_restarted"


@quickly_made
@dataclass(frozen=True, slots=True)
class Ruling:
    """What holds now: what guard, multiplexer and valve writer obey.

    Attributes:
        memory: Mode, what is latched, cause, author.
        law: What the valves carry out.
        may_open: The guard is armed.
        is_air_on: What is ordered of the float air.
        grace_s: After this time at the latest the valve node is to land by itself; 0 at once, infinite
            where no stop is latched.
        waits_for: Checks of the arming gate that keep it on the ground, where flight is wanted.
    """

    memory: Memory
    law: Law
    may_open: bool
    is_air_on: bool
    grace_s: float
    waits_for: tuple[str, ...]


class Supervisor:
    """Decides for one vehicle.

    Args:
        sightings: What it looks at, kept up to date by the caller.
        rest_s: Unbroken rest that is asked for before take-off.
        period_ns: Between looks.
        starts_by_itself: Flight is wanted from the start.
    """

    def __init__(
        self, sightings: Sightings, *, rest_s: float, period_ns: int, starts_by_itself: bool
    ) -> None:
        self.sightings = sightings
        self.board = FaultBoard()
        self._machine = ModeMachine(sightings.began_ns, starts_by_itself=starts_by_itself)
        self._rest_s = rest_s
        self._period_ns = period_ns
        self._override = ""
        self._air_since_ns: int | None = None
        self._restarted = ""
        self._waits_for: tuple[str, ...] = ()

    @property
    def mode(self) -> Mode:
        """The mode."""
        return self._machine.mode

    def ruling(self) -> Ruling:
        """What holds now."""
        machine, memory = self._machine, self._machine.memory
        guarantee = GUARANTEES[memory.mode]
        is_air_on = guarantee.air is Air.ON or (guarantee.air is Air.AS_WANTED and machine.wants_air)
        grace_s = float("inf")
        if memory.is_stop_latched:
            grace_s = GRACE_S if memory.mode in BRAKEABLE else 0.0
        latched = self.board.latched
        if latched != memory.latched:
            memory = replace(memory, latched=latched)
        return Ruling(memory, guarantee.law, guarantee.may_open, is_air_on, grace_s, self._waits_for)

    def recall(self, memory: Memory, now_ns: int) -> None:
        """Take up what was kept before a restart."""
        self._machine.recall(memory, now_ns)
        self.board.recall(memory.latched, now_ns)
        if self.mode in BRAKEABLE:
            self._restarted = f"it was {memory.mode}"

    def press(self, author: str, press_id: int, now_ns: int) -> bool:
        """The stop is pressed; False where it is the same press again."""
        if not self._machine.press(author, press_id, now_ns):
            return False
        self._cut_what_cannot_brake(now_ns)
        return True

    def request(self, event: Event, author: str, now_ns: int, override: str = "") -> str:
        """What a person asks for; the reason if it is refused.

        Args:
            event: What.
            author: Who asks.
            now_ns: When.
            override: Reason to fly in spite of the checks that may be overridden; empty for none.
        """
        against = self._objections(now_ns, override)
        refusal = self._machine.apply(
            event, now_ns, author, f"override: {override}" if override else "", against
        )
        if not refusal and event in (Event.FLY, Event.RELEASE):
            self._override = override
            self.board.clear()
        return refusal

    def look(self, now_ns: int) -> bool:
        """Look at everything; due every period. True if a fault began or ended."""
        machine, sightings = self._machine, self.sightings
        sightings.look(now_ns, self._period_ns)
        self._follow_node(now_ns)
        mode = machine.mode
        found = faults_seen(
            sightings,
            now_ns,
            is_grounded=mode in GROUNDED,
            is_aloft=mode in ALOFT,
            may_open=GUARANTEES[mode].may_open,
        )
        if self._restarted:
            found[RESTARTED], self._restarted = self._restarted, ""
        changed = self.board.look(now_ns, found)
        self._respond(now_ns)
        machine.pass_time(now_ns, is_at_rest=sightings.is_at_rest and not sightings.is_state_silent(now_ns))
        self._waits_for = ()
        if self.mode is Mode.RESTING:
            self._waits_for = self._objections(now_ns, self._override)
            if not self._waits_for:
                machine.happen(Event.READY, now_ns)
        return changed

    def _objections(self, now_ns: int, override: str) -> tuple[str, ...]:
        question = Question(self.sightings, tuple(self.board), self._rest_s, now_ns)
        return objections(question, override)

    def _follow_node(self, now_ns: int) -> None:
        """What the valve node reports of the air, and whether it reports at all."""
        machine, node = self._machine, self.sightings.node
        if self.sightings.is_node_silent(now_ns):
            machine.happen(Event.NODE_SILENT, now_ns)
            return
        machine.happen(Event.NODE_BACK, now_ns)
        if node is None:
            return
        if not node.floating:
            was_on, self._air_since_ns = self._air_since_ns is not None, None
            if was_on or self.mode is not Mode.FLOATING:  # there the order may still be on its way
                machine.happen(Event.AIR_IS_OFF, now_ns)
        elif self._air_since_ns is None:
            self._air_since_ns = now_ns
        if self._air_since_ns is not None and now_ns - self._air_since_ns >= LIFT_S * 1e9:
            machine.happen(Event.AIR_IS_ON, now_ns)

    def _respond(self, now_ns: int) -> None:
        """Do what the worst fault asks for; what it asked for before it was gone ends with it."""
        worst = self.board.worst()
        machine = self._machine
        if worst is None:
            machine.happen(Event.FAULTS_GONE, now_ns)
            return
        event = _EVENTS[worst.response]
        if self._is_due(event) and machine.happen(event, now_ns, _words(worst)):
            self._ground(worst)

    def _is_due(self, event: Event) -> bool:
        """Whether the response still changes anything: braking that leads to a landing is not begun again."""
        if event is Event.FAULT_LANDS:
            return self.mode not in (Mode.BRAKING, Mode.HOLDING) or self._machine.then is not Then.LAND
        return True

    def _ground(self, worst: Standing) -> None:
        """What a person has to clear keeps it down."""
        if worst.fault.clears is Clears.PERSON:
            self._machine.give_up_flight()

    def _cut_what_cannot_brake(self, now_ns: int) -> None:
        """A stop without a state to brake on, or without room, cuts the air at once."""
        sightings = self.sightings
        if self.mode in BRAKEABLE:
            found = faults_seen(sightings, now_ns, is_grounded=False, is_aloft=True, may_open=True)
            hopeless = found.keys() & _HOPELESS
            if hopeless:
                self._machine.happen(Event.FAULT_CUTS, now_ns, min(hopeless))


_HOPELESS = frozenset(
    {"state_silent", "fusion_lost", "edge_unavoidable", "vehicle_unavoidable", "can_silent"}
)
_EVENTS = {
    Response.HOLD: Event.FAULT_HOLDS,
    Response.LAND: Event.FAULT_LANDS,
    Response.CUT: Event.FAULT_CUTS,
}


def _words(standing: Standing) -> str:
    return f"{standing.fault.id} ({standing.detail})" if standing.detail else standing.fault.id
