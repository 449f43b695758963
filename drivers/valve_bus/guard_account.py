"""What the guard states about itself: verdicts, the state of the gate, counters, what it sends."""

from dataclasses import dataclass
from enum import StrEnum

from drivers.quick_record import quickly_made
from drivers.valve_bus.messages import ValveBusMessage, ValveCommand


class Verdict(StrEnum):
    """What the guard made of an incoming command."""

    NEW_PULSE = "new_pulse"
    """Accepted; the next tick opens its valves if the guard is armed."""
    REFRESHED = "refreshed"
    """Accepted; nothing new to open."""
    FIRST_AFTER_SILENCE = "first_after_silence"
    """Noted only: the next command in sequence shows that somebody is really there."""
    REPEATED_COUNTER = "repeated_counter"
    COUNTER_BACKWARDS = "counter_backwards"
    MALFORMED = "malformed"
    OTHER_VEHICLE = "other_vehicle"


class Gate(StrEnum):
    """Why the valves are closed, most serious first, or that they may open."""

    STOPPED = "stopped"
    DISARMED = "disarmed"
    STALE = "stale"
    OPEN = "open"


@dataclass(slots=True)
class GuardCounters:
    """What happened since the guard began."""

    commands: int = 0
    """Received, whatever became of them."""
    new_pulses: int = 0
    superseded_pulses: int = 0
    """Replaced by a newer pulse before a tick could send them."""
    lost_commands: int = 0
    """By the gaps in the counter."""
    first_after_silence: int = 0
    repeated_counter: int = 0
    counter_backwards: int = 0
    malformed: int = 0
    other_vehicle: int = 0
    clipped_by_run: int = 0
    """Valve openings shortened by the longest run allowed."""
    clipped_by_duty: int = 0
    stale_cuts: int = 0
    """Times that silence closed a valve that was open."""
    stops: int = 0
    clock_went_back: int = 0


@quickly_made
@dataclass(frozen=True, slots=True)
class GuardOutput:
    """What a tick sends and why.

    Attributes:
        messages: All that goes to the bus, in this order; the last is `command`.
        command: The valve command of this tick.
        gate: Whether valves may be open, or why not.
        open_mask: Bit i: valve i is open after this frame.
    """

    messages: tuple[ValveBusMessage, ...]
    command: ValveCommand
    gate: Gate
    open_mask: int
