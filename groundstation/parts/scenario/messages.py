"""What the player of a timeline publishes: markers, and how far it has come."""

from dataclasses import dataclass
from typing import ClassVar

from groundstation.declarations.message import I64, PACKAGE, U32, Message, Text
from groundstation.declarations.topic import Rank, Scope, Topic

WAITING, RUNNING, ENDED, FAILED = "waiting", "running", "ended", "failed"
"""States of a scenario: until the vehicles fly; then until its end, or until it cannot be carried out."""


@dataclass(frozen=True, slots=True, eq=False)
class Marker(Message):
    """A moment that a timeline, or a person, gives a name.

    Attributes:
        text: What is to be found again.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/Marker"
    TOPIC: ClassVar = Topic("marker", rank=Rank.REQUEST, scope=Scope.RIG)
    text: Text


@dataclass(frozen=True, slots=True, eq=False)
class ScenarioStatus(Message):
    """How far a scenario has come; latched, and published five times a second.

    Attributes:
        name: Of the scenario.
        state: ``waiting``, ``running``, ``ended`` or ``failed``.
        zero_ns: Stamp of t = 0; 0 before.
        fired: Rows of the timeline that have been carried out.
        waits_for: In words; empty where it waits for nothing but time.
        reason: Why it failed, a sentence; empty otherwise.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ScenarioStatus"
    TOPIC: ClassVar = Topic("scenario_status", 5, rank=Rank.REPORT, scope=Scope.RIG, latched=True)
    name: Text
    state: Text
    zero_ns: I64
    fired: U32
    waits_for: Text
    reason: Text
