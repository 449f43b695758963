"""The state machine of one vehicle: modes, what is latched, and what braking leads to. Pure.

What a person closed, a person opens: a stop ends by a release alone, and after ``land``, ``disarm`` or
``float_off`` only a person's request lets the vehicle fly. What must survive a restart is its ``Memory``.
"""

from collections import deque
from dataclasses import dataclass, replace
from enum import IntEnum

from groundstation.supervision.modes import BRAKEABLE, GROUNDED, Event, Mode, Who, transition

HOLD_S = 2.0
"""At rest before the air is cut: the estimate settles, and people see that it stands."""
LONGEST_BRAKING_S = 10.0
"""A stop that has not come to rest by then lands all the same."""
GRACE_S = LONGEST_BRAKING_S + HOLD_S
"""After this time at the latest a valve node that was announced a stop lands by itself."""
NEW_PRESS_S = 0.5
"""A new press at least this long after the one before cuts everything at once."""
_PRESSES = 64


class Then(IntEnum):
    """What braking leads to, weakest first: only a person's resume takes a stronger one back."""

    FLY = 0
    HOLD = 1
    LAND = 2


@dataclass(frozen=True, slots=True)
class Memory:
    """What survives a restart of every process.

    Attributes:
        mode: The mode.
        is_stop_latched: A person pressed stop and nobody has released it.
        is_flight_wanted: It takes off by itself as soon as it may.
        then: What braking leads to.
        cause: Of the mode.
        author: Who asked for it; empty for the station itself.
        since_ns: When the mode began, host monotonic clock.
        latched: Faults that a person has to clear.
    """

    mode: Mode
    is_stop_latched: bool
    is_flight_wanted: bool
    then: Then
    cause: str
    author: str
    since_ns: int
    latched: tuple[str, ...] = ()


class ModeMachine:
    """Modes of one vehicle.

    Args:
        now_ns: When it begins.
        starts_by_itself: Whether flight is wanted from the start.
    """

    def __init__(self, now_ns: int, *, starts_by_itself: bool) -> None:
        mode = Mode.RESTING if starts_by_itself else Mode.LANDED
        self.memory = Memory(mode, False, starts_by_itself, Then.FLY, "it has just begun", "", now_ns)
        self.wants_air = False
        self._pressed_ns: int | None = None
        self._presses: deque[tuple[str, int]] = deque(maxlen=_PRESSES)

    @property
    def mode(self) -> Mode:
        """The mode."""
        return self.memory.mode

    @property
    def then(self) -> Then:
        """What braking leads to."""
        return self.memory.then

    def recall(self, memory: Memory, now_ns: int) -> None:
        """Take up what was kept on disk before a restart.

        A vehicle that may be moving brakes, where its braking was not meant to end in a landing; what was
        about to land lands. Who had stopped it stays its author.
        """
        before = memory.mode
        if before in GROUNDED:
            mode = before
        else:
            brakes = before in BRAKEABLE and memory.then is not Then.LAND
            mode = Mode.BRAKING if brakes else Mode.LANDING
        self.wants_air = mode is Mode.BRAKING
        cause = memory.cause if mode is before else f"started again while {before}: {memory.cause}"
        self.memory = replace(memory, mode=mode, cause=cause, since_ns=now_ns)

    def press(self, author: str, press_id: int, now_ns: int) -> bool:
        """The stop is pressed; False where it is the same press, repeated or bouncing."""
        if (author, press_id) in self._presses:
            return False
        self._presses.append((author, press_id))
        last_ns, self._pressed_ns = self._pressed_ns, now_ns
        is_again = self.memory.is_stop_latched and last_ns is not None
        if is_again and last_ns is not None and now_ns - last_ns < NEW_PRESS_S * 1e9:
            self._pressed_ns = last_ns
            return False
        self.apply(Event.STOP_AGAIN if is_again else Event.STOP, now_ns, author)
        return True

    def apply(
        self, event: Event, now_ns: int, author: str = "", cause: str = "", objections: tuple[str, ...] = ()
    ) -> str:
        """Let something happen.

        Args:
            event: What.
            now_ns: When.
            author: Who asked for it; empty for the station itself.
            cause: What the table's words are followed by.
            objections: Of the arming gate; they refuse gated transitions.

        Returns:
            The reason why it does not count in this mode; empty if it does.
        """
        row = transition(self.mode, event)
        if row is None or not self._may_fly_on(event):
            return _refusal(event, self.memory)
        if author and row.who is Who.STATION:
            return f"{event} is for the station itself to decide"
        if row.is_gated and objections:
            return "; ".join(objections)
        was_stopped = self.memory.is_stop_latched
        self._note(event)
        after = row.after
        if after is Mode.LANDED and event is Event.AIR_IS_OFF:
            after = self._grounded()
        words = f"{row.cause}: {cause}" if cause else row.cause
        is_stopped_already = was_stopped and event in _LANDINGS
        keeps_cause = ((event, self.mode) in _KEEPS_CAUSE or is_stopped_already) and not cause
        stays = after is self.mode
        self.memory = replace(
            self.memory,
            mode=after,
            cause=self.memory.cause if keeps_cause else words,
            author=self.memory.author if keeps_cause else author,
            since_ns=self.memory.since_ns if stays else now_ns,
        )
        return ""

    def happen(self, event: Event, now_ns: int, cause: str = "") -> bool:
        """Let something happen that the station itself sees or decides; whether it counts in this mode.

        Most of it is tried fifty times a second and counts once in a flight: nobody reads why it does not.
        """
        if transition(self.mode, event) is None:
            return False
        return not self.apply(event, now_ns, cause=cause)

    def _may_fly_on(self, event: Event) -> bool:
        """Whether braking was not begun for something stronger than what the event takes back."""
        return self.memory.then <= _TAKES_BACK.get(event, Then.LAND)

    def _grounded(self) -> Mode:
        if self.memory.is_stop_latched:
            return Mode.STOPPED
        return Mode.RESTING if self.memory.is_flight_wanted else Mode.LANDED

    def _note(self, event: Event) -> None:
        """Note what the event latches, wants, and what braking then leads to."""
        wanted, latched, then = self.memory.is_flight_wanted, self.memory.is_stop_latched, self.memory.then
        match event:
            case Event.FLY:
                wanted = True
            case Event.READY:
                self.wants_air = True
            case Event.FLOAT_ON:
                wanted, self.wants_air = False, True
            case Event.ARM:
                wanted = False
            case Event.STOP | Event.STOP_AGAIN:
                wanted, latched, then = False, True, Then.LAND
            case Event.LAND | Event.DISARM | Event.FLOAT_OFF:
                wanted, self.wants_air = False, False
            case Event.RELEASE:
                wanted, latched, self._pressed_ns = False, False, None
            case Event.BRAKE:
                then = max(then, Then.HOLD)
            case Event.FAULT_LANDS:
                then = Then.LAND
            case Event.FAULT_HOLDS | Event.RESUME | Event.AIR_IS_ON:
                then = Then.FLY
            case Event.AIR_IS_OFF | Event.NODE_SILENT:
                self.wants_air = False
        self.memory = replace(self.memory, is_flight_wanted=wanted, is_stop_latched=latched, then=then)

    def give_up_flight(self) -> None:
        """Flight is wanted no longer: what brought it down is for a person to clear."""
        self.memory = replace(self.memory, is_flight_wanted=False)

    def pass_time(self, now_ns: int, *, is_at_rest: bool) -> None:
        """Braking ends at rest, holding after a while; where it leads to a landing, in any case."""
        age_s = (now_ns - self.memory.since_ns) * 1e-9
        if self.mode is Mode.BRAKING:
            if is_at_rest:
                self.happen(Event.AT_REST, now_ns)
            elif self.then is Then.LAND and age_s >= LONGEST_BRAKING_S:
                self.happen(Event.HELD, now_ns, cause=f"not at rest after {LONGEST_BRAKING_S:g} s")
        elif self.mode is Mode.HOLDING and self.then is Then.LAND and age_s >= HOLD_S:
            self.happen(Event.HELD, now_ns)


_TAKES_BACK = {Event.RESUME: Then.HOLD, Event.FAULTS_GONE: Then.FLY}
"""The strongest end of braking that these events take back."""
_LANDINGS = frozenset({Event.LAND, Event.DISARM, Event.FLOAT_OFF})
"""Of a vehicle that a person has stopped already: who stopped it stays the one to be named."""
_KEEPS_CAUSE = frozenset(
    {
        (Event.AT_REST, Mode.BRAKING),
        (Event.HELD, Mode.HOLDING),
        (Event.AIR_IS_OFF, Mode.LANDING),
    }
)
"""Events that carry on, in a mode, what something else began: its cause stays the one to be shown."""


def _refusal(event: Event, memory: Memory) -> str:
    if memory.is_stop_latched and event is not Event.RELEASE:
        whose = f" by {memory.author}" if memory.author else ""
        return f"a stop is latched{whose}: release it first"
    if memory.mode in BRAKEABLE and event is Event.RESUME:
        return f"it is about to land: {memory.cause}"
    hint = _HINTS.get(event) if not memory.is_stop_latched else "wait until it is down"
    if event is Event.FLY and memory.mode is Mode.ARMED:
        hint = "float_on lets it fly, once it is armed"
    return f"{event} does not count while it is {memory.mode}" + (f": {hint}" if hint else "")


_HINTS = {
    Event.ARM: "it is armed, or on its way down",
    Event.FLY: "it flies, or is on its way down",
    Event.FLOAT_ON: "wait until it is down",
    Event.BRAKE: "only a flying vehicle can brake",
    Event.RESUME: "only a braking vehicle can resume",
    Event.RELEASE: "no stop is latched",
}
