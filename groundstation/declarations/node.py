"""What a node is: a pure transformer with state, and its row in a part.

It names its input and output topics, is given the time, and returns messages. Three runners execute the
same object: live, lockstep and replay. ``now_ns`` is the moment at which the runner delivers a message (its
arrival); runners write it into the journal, so that a replay tells the same moments.
"""

import importlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import Enum, auto
from typing import ClassVar

from groundstation.declarations.message import Message
from groundstation.declarations.rig import Rig


class Node(ABC):
    """Base of all nodes.

    Class attributes:
        inputs: Payload classes it receives; a node may set them when it is made.
        paced: Those of the inputs that it takes at the pace of their topic, where every message is more
            than it needs: each one wakes its process.
        outputs: Payload classes it may publish; the runner refuses others.
        trigger: What a message that is made in a tick was made from: the newest of this input. None
            where ticks report on the node itself.

    Attributes:
        vehicle: Whose it is, empty for a node of the whole rig.
        tick_period_ns: 0 for a node that only answers messages.
    """

    inputs: tuple[type[Message], ...] = ()
    paced: ClassVar[tuple[type[Message], ...]] = ()
    outputs: ClassVar[tuple[type[Message], ...]] = ()
    trigger: ClassVar[type[Message] | None] = None

    def __init__(self, vehicle: str, tick_period_ns: int = 0) -> None:
        self.vehicle = vehicle
        self.tick_period_ns = tick_period_ns

    def sources(self, payload: type[Message]) -> tuple[str, ...]:
        """Vehicles whose ``payload`` topic this node receives; its own unless a node states otherwise."""
        del payload
        return (self.vehicle,)

    def takes_paced(self, payload: type[Message], source: str) -> bool:
        """Whether it takes a vehicle's ``payload`` topic paced; by kind unless a node states otherwise."""
        del source
        return payload in self.paced

    def start(self, now_ns: int) -> Iterable[Message]:
        """Messages to publish before anything is received, e.g. latched calibrations."""
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
        """The process ends in good order; last messages, e.g. closed valves."""
        del now_ns
        return ()


class Weight(Enum):
    """What a node may share a process with."""

    HEAVY = auto()  # never with an urgent node
    LIGHT = auto()
    URGENT = auto()  # IMU, fusion, valves: never with a heavy node


FLIGHT, SKY, COMMANDS, STATION = "{vehicle}_flight", "{vehicle}_sky", "commands", "station"
"""The usual processes."""


def always(rig: Rig, vehicle: str) -> bool:
    """Every vehicle has it."""
    del rig, vehicle
    return True


@dataclass(frozen=True, slots=True)
class NodeRow:
    """A node as its part declares it.

    Attributes:
        name: As in rig files, journals and health.
        process: Default process, or what gives it; ``{vehicle}`` is filled in.
        weight: What it may share a process with.
        kind: Its class, or ``module:Class`` where the module is imported only by the process that runs it.
        make: Builds it from the rig for a vehicle.
        condition: Whether a vehicle has it.
        is_of_rig: One for the whole rig instead of one per vehicle; its vehicle is empty.
    """

    name: str
    process: str | Callable[[Rig, str], str]
    weight: Weight
    kind: type[Node] | str
    make: Callable[[Rig, str], Node]
    condition: Callable[[Rig, str], bool] = always
    is_of_rig: bool = False

    def vehicles(self, rig: Rig) -> list[str]:
        """Vehicles that have this node; one empty name for a node of the rig."""
        if self.is_of_rig:
            return [""] if self.condition(rig, "") else []
        return [name for name in rig.vehicles if self.condition(rig, name)]

    def node_class(self) -> type[Node]:
        """Its class, imported now."""
        if not isinstance(self.kind, str):
            return self.kind
        module, _, name = self.kind.partition(":")
        found: type[Node] = getattr(importlib.import_module(module), name)
        return found

    def home(self, rig: Rig, vehicle: str) -> str:
        """The process of the node: the rig's word, or the row's."""
        section = rig.nodes.get(self.name)
        template = section.process if section is not None else None
        if template is None:
            template = self.process if isinstance(self.process, str) else self.process(rig, vehicle)
        return template.replace("{vehicle}", vehicle)

    def key(self, vehicle: str) -> str:
        """Key of the node in journals: ``vehicle/name``, or ``name`` for a node of the rig."""
        return f"{vehicle}/{self.name}" if vehicle else self.name
