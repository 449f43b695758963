"""What the supervisor rules, what it remembers, presses of the stop, and faults."""

from dataclasses import dataclass
from typing import ClassVar

from groundstation.declarations.message import (
    F64,
    I64,
    PACKAGE,
    U32,
    Bool,
    Float64Sequence,
    Message,
    Text,
    TextSequence,
)
from groundstation.declarations.topic import Rank, Scope, Topic
from groundstation.supervision.modes import BRAKEABLE


@dataclass(frozen=True, slots=True, eq=False)
class Supervision(Message):
    """The ruling on a vehicle: what guard, multiplexer and valve writer obey; latched.

    Attributes:
        mode: ``landed``, ``resting``, ``floating``, ``armed``, ``flying``, ``braking``, ``holding``,
            ``stopped``, ``landing`` or ``lost``.
        law: What the valves carry out: ``closed``, ``brake`` or ``controller``.
        may_open: The guard is to be armed.
        air_on: What is ordered of the float air.
        stop_latched: A person pressed stop and nobody has released it.
        grace_s: After this time at the latest the valve node lands by itself; 0 at once, infinite without
            a stop.
        flight_wanted: It takes off by itself as soon as it may.
        then: What braking leads to: 0 flight, 1 holding, 2 landing.
        cause: Why it is in this mode.
        author: Who asked for it; empty for the station itself.
        since_ns: When the mode began.
        waits_for: Checks that keep it on the ground, where flight is wanted.
        latched: Faults that a person has to clear.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/Supervision"
    TOPIC: ClassVar = Topic("supervision", 10, Rank.VALVES, latched=True)
    mode: Text
    law: Text
    may_open: Bool
    air_on: Bool
    stop_latched: Bool
    grace_s: F64
    flight_wanted: Bool
    then: U32
    cause: Text
    author: Text
    since_ns: I64
    waits_for: TextSequence
    latched: TextSequence

    @property
    def is_in_flight(self) -> bool:
        """Whether it floats and valves may push: flying, braking or holding."""
        return self.mode in BRAKEABLE


@dataclass(frozen=True, slots=True, eq=False)
class Recalled(Message):
    """What was kept on disk of the last ruling, at the start of the process.

    Attributes:
        content: JSON object; empty where nothing was kept.
        trouble: Why what was kept cannot be read; empty if it can.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/Recalled"
    TOPIC: ClassVar = Topic("recalled", rank=Rank.REQUEST)
    content: Text
    trouble: Text


@dataclass(frozen=True, slots=True, eq=False)
class StopPress(Message):
    """A press of the stop, for one vehicle or (vehicle empty) for all; it has a path of its own.

    Attributes:
        press_id: Repetitions of an id by one author are one press.
        author: Who pressed.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/StopPress"
    TOPIC: ClassVar = Topic("stop_press", rank=Rank.REQUEST, scope=Scope.PROCESS, is_apart=True)
    press_id: U32
    author: Text


@dataclass(frozen=True, slots=True, eq=False)
class Findings(Message):
    """What the fault detector of a vehicle finds wrong at this moment.

    Attributes:
        ids: Rows of the table of faults.
        details: With numbers, one per id.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/Findings"
    TOPIC: ClassVar = Topic("findings", 10, Rank.ESTIMATE)
    ids: TextSequence
    details: TextSequence


@dataclass(frozen=True, slots=True, eq=False)
class ValveShares(Message):
    """What each valve is taken to give, as shares of the rig's thrust: the allocation plans with it; latched.

    Attributes:
        open_ratio: While commanded open: 1 for a healthy valve.
        shut_ratio: While commanded shut: 0 for a healthy valve.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ValveShares"
    TOPIC: ClassVar = Topic("valve_shares", rank=Rank.ESTIMATE, latched=True)
    open_ratio: Float64Sequence
    shut_ratio: Float64Sequence


@dataclass(frozen=True, slots=True, eq=False)
class ValvesLearned(Message):
    """What flying has told of each valve by now; NaN where it has told nothing yet; latched.

    Only thrust over mass and torque over inertia can be seen in motion, so a mass that is wrong looks like
    valves that all are; and only the time between the shifts of opening and closing, for a common shift looks
    like stamps that are late.

    Attributes:
        thrust_over_mass_ratio: Over the rig's.
        thrust_over_mass_sigma: Its standard deviation.
        torque_over_inertia_ratio: Over the rig's.
        torque_over_inertia_sigma: Its standard deviation.
        dead_time_s: Opening less closing delay: by so much a pulse pushes shorter than it is commanded.
        dead_time_sigma_s: Its standard deviation.
        open_s: How long it was open while it was learned from.
        set_aside: Blocks that something pushed in which is no valve.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ValvesLearned"
    TOPIC: ClassVar = Topic("valves_learned", 1, Rank.ESTIMATE, latched=True)
    thrust_over_mass_ratio: Float64Sequence
    thrust_over_mass_sigma: Float64Sequence
    torque_over_inertia_ratio: Float64Sequence
    torque_over_inertia_sigma: Float64Sequence
    dead_time_s: Float64Sequence
    dead_time_sigma_s: Float64Sequence
    open_s: Float64Sequence
    set_aside: U32


@dataclass(frozen=True, slots=True, eq=False)
class Faults(Message):
    """Every fault that a vehicle has, until it clears; latched. Published when one begins or ends.

    Attributes:
        ids: Rows of the table of faults.
        whats: What is wrong, a sentence each.
        details: What was found, with numbers.
        since_ns: When each was found, as a float.
        responses: What is being done.
        advices: What a person can do.
        gone_ns: When it was seen last, where it is only latched and a release clears it; 0 while it is there.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/Faults"
    TOPIC: ClassVar = Topic("faults", rank=Rank.VALVES, latched=True)
    ids: TextSequence
    whats: TextSequence
    details: TextSequence
    since_ns: Float64Sequence
    responses: TextSequence
    advices: TextSequence
    gone_ns: Float64Sequence
