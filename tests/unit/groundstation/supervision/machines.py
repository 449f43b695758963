"""State machines in any state: what the tests of the modes share."""

from dataclasses import replace

from groundstation.supervision.mode_machine import Memory, ModeMachine, Then
from groundstation.supervision.modes import TRANSITIONS, Event, Mode, Who

S = 1_000_000_000
PERSON = "anna"
PERSONS = sorted({row.event for row in TRANSITIONS if row.who is Who.PERSON})
STATIONS = sorted({row.event for row in TRANSITIONS if row.who is Who.STATION})
OF_MODE = {mode: Memory(mode, False, False, Then.FLY, "why", "", 0) for mode in Mode}


def machine(mode=Mode.LANDED, **changes):
    made = ModeMachine(0, starts_by_itself=False)
    made.memory = replace(OF_MODE[mode], **changes)
    return made


def driven(*events, starts_by_itself=False):
    made = ModeMachine(0, starts_by_itself=starts_by_itself)
    for event in events:
        assert made.apply(event, 0, PERSON if event in PERSONS else "") == ""
    return made


FLYING = (Event.FLY, Event.READY, Event.AIR_IS_ON)


def rules(vehicle):
    """What a supervisor rules on its vehicle: law, whether valves may open, whether the air is on."""
    ruling = vehicle.ruling
    return ruling.law, ruling.may_open, ruling.is_air_on
