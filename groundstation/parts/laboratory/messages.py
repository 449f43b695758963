"""Failures that the laboratory injects; faults are what the station detects."""

from dataclasses import dataclass
from typing import ClassVar

from groundstation.declarations.message import F64, PACKAGE, Bool, Message, Text
from groundstation.declarations.topic import Rank, Scope, Topic


@dataclass(frozen=True, slots=True, eq=False)
class InjectedFailure(Message):
    """A failure of the laboratory has begun or ended, or an order to inject one was refused.

    Attributes:
        failure: Row of the laboratory's table of failures; empty for a refusal.
        parameters: JSON object of its parameters; null for one that is not a number.
        is_active: True when it begins, False when it ends.
        refusal: Why an order was not obeyed; empty otherwise.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/InjectedFailure"
    TOPIC: ClassVar = Topic("injected_failure", rank=Rank.REQUEST, observers_only=True)
    failure: Text
    parameters: Text
    is_active: Bool
    refusal: Text


@dataclass(frozen=True, slots=True, eq=False)
class FailureOrder(Message):
    """An order to the laboratory to inject a failure now.

    Attributes:
        target: Vehicle that it is to befall.
        failure: Row of the laboratory's table of failures.
        parameters: JSON object of those that differ from their defaults.
        for_s: How long.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/FailureOrder"
    TOPIC: ClassVar = Topic("failure_order", rank=Rank.REQUEST, scope=Scope.RIG)
    target: Text
    failure: Text
    parameters: Text
    for_s: F64
