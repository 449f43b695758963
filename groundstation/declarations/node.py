"""What a node is: a pure transformer with state.

It names what it hears and says, is told the time, and returns messages. Three runners execute the
same object: live, lockstep and replay. ``now_ns`` is the moment at which the runner hands over a
message (its arrival); runners write it into the journal, so that a replay tells the same moments.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import ClassVar

from groundstation.messages.base import Message


class Node(ABC):
    """Base of all nodes.

    Class attributes:
        inputs: Payload classes it hears.
        outputs: Payload classes it may say; the runner refuses others.

    Attributes:
        vehicle: Whose it is, empty for a node of the whole rig.
        tick_period_ns: 0 for a node that only answers messages.
    """

    inputs: ClassVar[tuple[type[Message], ...]] = ()
    outputs: ClassVar[tuple[type[Message], ...]] = ()

    def __init__(self, vehicle: str, tick_period_ns: int = 0) -> None:
        self.vehicle = vehicle
        self.tick_period_ns = tick_period_ns

    def vehicles_heard(self, payload: type[Message]) -> tuple[str, ...]:
        """Vehicles whose ``payload`` topic this node hears; its own unless a node says otherwise."""
        del payload
        return (self.vehicle,)

    def start(self, now_ns: int) -> Iterable[Message]:
        """Messages to say before anything is heard, e.g. latched calibrations."""
        del now_ns
        return ()

    @abstractmethod
    def receive(self, message: Message, now_ns: int) -> Iterable[Message]:
        """Take one message that arrived at ``now_ns``."""

    def tick(self, now_ns: int) -> Iterable[Message]:
        """Time passed; called every ``tick_period_ns``."""
        del now_ns
        return ()

    def stop(self, now_ns: int) -> Iterable[Message]:
        """The process ends in good order; last words, e.g. closed valves."""
        del now_ns
        return ()
