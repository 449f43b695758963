"""Modes of a vehicle, what each guarantees, and THE TABLE of transitions between them.

On a table without friction nothing stops by itself: closed valves mean coasting, and only landing, that is
cutting the float air, always ends a motion. So a fault brakes while there is ground to brake on, and lands.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, StrEnum, auto


class Mode(StrEnum):
    """What a vehicle is doing as a whole."""

    LANDED = "landed"
    RESTING = "resting"
    FLOATING = "floating"
    ARMED = "armed"
    FLYING = "flying"
    BRAKING = "braking"
    HOLDING = "holding"
    STOPPED = "stopped"
    LANDING = "landing"
    LOST = "lost"


class Law(StrEnum):
    """What the valves may carry out."""

    CLOSED = "closed"
    BRAKE = "brake"
    CONTROLLER = "controller"


class Air(Enum):
    """What is ordered of the float air."""

    OFF = auto()
    ON = auto()
    AS_WANTED = auto()


@dataclass(frozen=True, slots=True)
class Guarantee:
    """What holds in a mode, whatever else goes wrong.

    Attributes:
        law: What the valves carry out.
        may_open: The guard is armed.
        air: What is ordered of the float air, again and again until the valve node reports it.
        summary: For people.
    """

    law: Law
    may_open: bool
    air: Air
    summary: str


GUARANTEES: Mapping[Mode, Guarantee] = {
    Mode.LANDED: Guarantee(Law.CLOSED, False, Air.OFF, "Air off, valves closed, disarmed."),
    Mode.RESTING: Guarantee(
        Law.CLOSED, False, Air.OFF, "As landed; it takes off once every check of the arming gate passes."
    ),
    Mode.FLOATING: Guarantee(
        Law.CLOSED, False, Air.ON, "Air on by a person's explicit wish, valves closed, disarmed: it slides."
    ),
    Mode.ARMED: Guarantee(
        Law.CLOSED, True, Air.AS_WANTED, "Armed with closed valves; the air comes on where flight is wanted."
    ),
    Mode.FLYING: Guarantee(Law.CONTROLLER, True, Air.ON, "The controller or an operator's push commands."),
    Mode.BRAKING: Guarantee(Law.BRAKE, True, Air.ON, "The brake law takes speed and turn away."),
    Mode.HOLDING: Guarantee(Law.BRAKE, True, Air.ON, "At rest; the brake law keeps it there."),
    Mode.STOPPED: Guarantee(
        Law.CLOSED, False, Air.OFF, "Air off, valves closed, disarmed, until a person releases the stop."
    ),
    Mode.LANDING: Guarantee(
        Law.CLOSED, False, Air.OFF, "Valves closed, disarmed, air cut; ends when the valve node reports it."
    ),
    Mode.LOST: Guarantee(
        Law.CLOSED, False, Air.OFF,
        "Nothing comes from the valve node: air off is ordered, and by itself the node cuts it after 1 s.",
    ),
}  # fmt: skip
"""What each mode guarantees."""


class Event(StrEnum):
    """What moves a vehicle from one mode to another; the first ones can be requested."""

    FLY = "fly"
    ARM = "arm"
    DISARM = "disarm"
    FLOAT_ON = "float_on"
    FLOAT_OFF = "float_off"
    LAND = "land"
    STOP = "stop"
    RELEASE = "release"
    BRAKE = "brake"
    RESUME = "resume"
    STOP_AGAIN = "stop_again"
    READY = "ready"
    AIR_IS_ON = "air_is_on"
    AIR_IS_OFF = "air_is_off"
    AT_REST = "at_rest"
    HELD = "held"
    FAULT_HOLDS = "fault_holds"
    FAULT_LANDS = "fault_lands"
    FAULT_CUTS = "fault_cuts"
    FAULTS_GONE = "faults_gone"
    NODE_SILENT = "node_silent"
    NODE_BACK = "node_back"


class Who(StrEnum):
    """Whose a transition is."""

    PERSON = "a person"
    STATION = "the station itself"


@dataclass(frozen=True, slots=True)
class Transition:
    """A row of the table.

    Attributes:
        event: What happens.
        before: Modes in which it counts.
        after: The mode that follows.
        who: A person may ask for it, or the station decides it alone.
        cause: For people.
        is_gated: Every check of the arming gate must pass.
    """

    event: Event
    before: frozenset[Mode]
    after: Mode
    who: Who
    cause: str
    is_gated: bool


def _row(
    event: Event, before: tuple[Mode, ...], after: Mode, who: Who, cause: str, *, is_gated: bool = False
) -> Transition:
    return Transition(event, frozenset(before), after, who, cause, is_gated)


GROUNDED = (Mode.LANDED, Mode.RESTING, Mode.STOPPED)
"""Modes in which the air is off and known to be."""
BRAKEABLE = (Mode.FLYING, Mode.BRAKING, Mode.HOLDING)
"""Modes in which valves may push."""
ALOFT = (Mode.FLOATING, Mode.ARMED, *BRAKEABLE)
"""Modes in which the air is on, or about to be."""

_M, _E, _W = Mode, Event, Who
TRANSITIONS: tuple[Transition, ...] = (
    _row(_E.FLY, (_M.LANDED, _M.RESTING), _M.RESTING, _W.PERSON, "flight is wanted"),
    _row(_E.READY, (_M.RESTING,), _M.ARMED, _W.STATION, "every check passed", is_gated=True),
    _row(_E.ARM, (_M.LANDED, _M.RESTING, _M.FLOATING), _M.ARMED, _W.PERSON, "armed by request",
         is_gated=True),
    _row(_E.FLOAT_ON, (_M.LANDED, _M.RESTING), _M.FLOATING, _W.PERSON, "floats by request, unarmed"),
    _row(_E.FLOAT_ON, (_M.FLOATING,), _M.FLOATING, _W.PERSON, "floats by request, unarmed"),
    _row(_E.FLOAT_ON, (_M.ARMED,), _M.ARMED, _W.PERSON, "floats by request"),
    _row(_E.AIR_IS_ON, (_M.ARMED,), _M.FLYING, _W.STATION, "the float air carries it"),
    _row(_E.AIR_IS_OFF, (_M.FLYING, _M.BRAKING, _M.HOLDING, _M.FLOATING), _M.LANDING, _W.STATION,
         "its valve node reports that the float air is off"),
    _row(_E.BRAKE, (_M.FLYING, _M.BRAKING), _M.BRAKING, _W.PERSON, "brakes by request"),
    _row(_E.BRAKE, (_M.HOLDING,), _M.HOLDING, _W.PERSON, "brakes by request"),
    _row(_E.RESUME, BRAKEABLE, _M.FLYING, _W.PERSON, "resumed by request"),
    _row(_E.FAULT_HOLDS, (_M.FLYING,), _M.BRAKING, _W.STATION, "brakes for a fault"),
    _row(_E.FAULT_LANDS, BRAKEABLE, _M.BRAKING, _W.STATION, "brakes for a fault, then lands"),
    _row(_E.FAULT_LANDS, (_M.FLOATING, _M.ARMED), _M.LANDING, _W.STATION, "lands for a fault"),
    _row(_E.FAULT_CUTS, ALOFT, _M.LANDING, _W.STATION, "braking does not help: the air is cut"),
    _row(_E.FAULTS_GONE, (_M.BRAKING, _M.HOLDING), _M.FLYING, _W.STATION, "the fault is gone"),
    _row(_E.AT_REST, (_M.BRAKING,), _M.HOLDING, _W.STATION, "it is at rest"),
    _row(_E.HELD, (_M.BRAKING, _M.HOLDING), _M.LANDING, _W.STATION, "braked and held"),
    _row(_E.STOP, BRAKEABLE, _M.BRAKING, _W.PERSON, "stopped: brakes, holds, lands"),
    _row(_E.STOP, (_M.FLOATING, _M.ARMED, _M.LANDING, _M.LOST), _M.LANDING, _W.PERSON, "stopped: lands"),
    _row(_E.STOP, GROUNDED, _M.STOPPED, _W.PERSON, "stopped on the ground"),
    _row(_E.STOP_AGAIN, (*ALOFT, _M.LANDING, _M.LOST), _M.LANDING, _W.PERSON, "stopped twice: air cut"),
    _row(_E.STOP_AGAIN, GROUNDED, _M.STOPPED, _W.PERSON, "stopped on the ground"),
    _row(_E.LAND, (*ALOFT, _M.LANDING, _M.LOST), _M.LANDING, _W.PERSON, "landed by request"),
    _row(_E.LAND, (_M.LANDED, _M.RESTING), _M.LANDED, _W.PERSON, "landed by request"),
    _row(_E.LAND, (_M.STOPPED,), _M.STOPPED, _W.PERSON, "stopped"),
    _row(_E.DISARM, (*ALOFT, _M.LANDING, _M.LOST), _M.LANDING, _W.PERSON, "disarmed by request"),
    _row(_E.DISARM, (_M.LANDED, _M.RESTING), _M.LANDED, _W.PERSON, "disarmed by request"),
    _row(_E.DISARM, (_M.STOPPED,), _M.STOPPED, _W.PERSON, "stopped"),
    _row(_E.FLOAT_OFF, (*ALOFT, _M.LANDING, _M.LOST), _M.LANDING, _W.PERSON, "float air cut by request"),
    _row(_E.FLOAT_OFF, (_M.LANDED, _M.RESTING), _M.LANDED, _W.PERSON, "float air cut by request"),
    _row(_E.FLOAT_OFF, (_M.STOPPED,), _M.STOPPED, _W.PERSON, "stopped"),
    _row(_E.AIR_IS_OFF, (_M.LANDING,), _M.LANDED, _W.STATION, "its valve node reports that it is down"),
    _row(_E.NODE_SILENT, (*ALOFT, _M.LANDING), _M.LOST, _W.STATION, "nothing comes from the valve node"),
    _row(_E.NODE_BACK, (_M.LOST,), _M.LANDING, _W.STATION, "the valve node reports again"),
    _row(_E.RELEASE, (_M.STOPPED,), _M.LANDED, _W.PERSON, "released by request"),
    _row(_E.RELEASE, (_M.LANDED, _M.RESTING), _M.LANDED, _W.PERSON, "faults cleared by request"),
)  # fmt: skip
"""THE TABLE. What no row names is refused. Where a stop is latched, landing ends in ``stopped``."""


_BY_MODE = {(mode, row.event): row for row in TRANSITIONS for mode in row.before}


def transition(mode: Mode, event: Event) -> Transition | None:
    """The row for an event in a mode; None where it does not count there."""
    return _BY_MODE.get((mode, event))
