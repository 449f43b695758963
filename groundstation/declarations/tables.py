"""The tables of the whole system: the concatenation of what the parts declare, each name once."""

from collections.abc import Iterable, Mapping
from dataclasses import fields
from typing import TypeVar

from groundstation.declarations.checks import wrong_in, wrong_inputs
from groundstation.declarations.fix import FixSource
from groundstation.declarations.message import Message
from groundstation.declarations.node import NodeRow
from groundstation.declarations.part import Part
from groundstation.declarations.port import PortRow
from groundstation.declarations.request import Action

T = TypeVar("T")
STANDARD_PACKAGES = ("std_msgs/", "geometry_msgs/", "sensor_msgs/", "nav_msgs/")
"""Of ROS 2: their types have one layout, whichever class writes it."""


class PartError(ValueError):
    """Two parts declare the same name, or a part declares what nobody could run."""


class Tables:
    """What all parts together declare.

    Args:
        parts: In the order in which equal things are done: nodes of earlier parts receive first.
        topics: Payload classes of the runners themselves (journal).

    Attributes:
        parts: By name.
        payloads: Payload classes by the noun of their topic.
        nodes: Rows by name, in the order of the parts.
        ports: Rows, in the order of the parts.
        actions: Rows by name.
        fix_sources: Rows by name, the first that a vehicle has being its default.

    Raises:
        PartError: A name stands twice, a row names an unknown node, or a part declares what nobody could run.
    """

    def __init__(self, parts: Iterable[Part], topics: Iterable[type[Message]] = ()) -> None:
        listed = tuple(parts)
        for part in listed:
            _refuse(part, wrong_in(part))
        self.parts: Mapping[str, Part] = _by_name("part", ((part.name, part, part) for part in listed))
        own = ((kind.TOPIC.noun, kind, None) for kind in topics)
        declared = ((kind.TOPIC.noun, kind, part) for part in listed for kind in part.topics)
        self.payloads: Mapping[str, type[Message]] = _by_name("topic", (*own, *declared))
        self.nodes: Mapping[str, NodeRow] = _by_name(
            "node", ((row.name, row, part) for part in listed for row in part.nodes)
        )
        self.ports: tuple[PortRow, ...] = tuple(row for part in listed for row in part.ports)
        self.actions: Mapping[str, Action] = _by_name(
            "action", ((row.name, row, part) for part in listed for row in part.actions)
        )
        self.fix_sources: Mapping[str, FixSource] = _by_name(
            "fix source", ((row.name, row, part) for part in listed for row in part.fix_sources)
        )
        for port in self.ports:
            if port.node not in self.nodes:
                raise PartError(f"a port is read by a node {port.node!r}, which no part declares")
        self._check_classes()
        for action in self.actions.values():
            if action.answered_by not in self.nodes:
                raise PartError(
                    f"action {action.name!r} is answered by {action.answered_by!r}, which no part declares"
                )

    def part_of(self, row: NodeRow | PortRow) -> Part:
        """The part that declares a row."""
        return next(part for part in self.parts.values() if row in part.nodes or row in part.ports)

    def _check_classes(self) -> None:
        """What classes of nodes and ports take and give is declared; of those imported later, later."""
        payloads = self.payloads.values()
        for row in self.nodes.values():
            if not isinstance(row.kind, str):
                wrong = wrong_inputs(row.kind, payloads)
                _refuse(self.part_of(row), wrong and f"node {row.name!r} {wrong}")
        for port in self.ports:
            reads = getattr(port.kind, "reads", None)
            if reads not in payloads:
                wrong = (
                    f"the port of node {port.node!r} reads {reads!r:.80}, which no part declares as a topic"
                )
                _refuse(self.part_of(port), wrong)
        types: dict[str, type[Message]] = {}
        for kind in payloads:
            first = types.setdefault(kind.ROS_TYPE, kind)
            if not kind.ROS_TYPE.startswith(STANDARD_PACKAGES) and _layout(first) != _layout(kind):
                raise PartError(
                    f"the topics {first.TOPIC.noun!r} and {kind.TOPIC.noun!r} both have the ROS_TYPE "
                    f"{kind.ROS_TYPE!r} with different fields"
                )

    def owner(self, payload: type[Message]) -> str:
        """Name of the part that declares a payload class; empty for those of the runners."""
        return next((part.name for part in self.parts.values() if payload in part.topics), "")


def _layout(kind: type[Message]) -> list[tuple[str, object]]:
    return [(field.name, field.type) for field in fields(kind)]


def _refuse(part: Part, wrong: str) -> None:
    if wrong:
        raise PartError(f"{part.title}: {wrong}")


def _by_name(what: str, rows: Iterable[tuple[str, T, Part | None]]) -> dict[str, T]:
    """Rows by name; the part of each, None for the runners, is for the complaint."""
    found: dict[str, T] = {}
    owners: dict[str, Part | None] = {}
    for name, row, part in rows:
        if name in found:
            raise PartError(_complaint(what, name, owners[name], part))
        found[name], owners[name] = row, part
    return found


def _complaint(what: str, name: str, first: Part | None, second: Part | None) -> str:
    part = first or second
    if part is None:
        return f"the runners declare the {what} {name!r} twice"
    if first is None or second is None:
        return f"the part {part.name!r} declares the {what} {name!r}, which is the runners' own"
    if first is second:
        return f"the part {part.name!r} declares the {what} {name!r} twice"
    if what == "part":
        return f"two parts are named {name!r}"
    return f"the parts {first.name!r} and {second.name!r} both declare the {what} {name!r}"
