"""What a part declares is checked when the tables are made; its nodes are checked when they are made."""

import math
import re
from collections.abc import Callable, Collection, Iterator
from dataclasses import fields
from typing import Annotated, get_args, get_origin

from groundstation.declarations.calls import calling
from groundstation.declarations.errors import UsageError
from groundstation.declarations.fix import FixSource
from groundstation.declarations.message import Message
from groundstation.declarations.names import LOOKS, is_name
from groundstation.declarations.node import Node, NodeRow, Weight
from groundstation.declarations.part import Part
from groundstation.declarations.port import Port, PortRow
from groundstation.declarations.request import Action
from groundstation.declarations.section import Section
from groundstation.declarations.topic import Topic
from groundstation.declarations.view import GaugeRow

SHORTEST_TICK_NS = 1_000_000
"""Between two ticks of a node: a shorter period would leave its process no time for anything else."""
_ROS_TYPE = re.compile(r"[a-z]\w*/msg/[A-Z]\w*")
_FIELD = re.compile(r"(bool|u?int(8|16|32|64)|float(32|64)|string)(\[\d*\])?")
_LATER = re.compile(r"\w+(\.\w+)*:[A-Za-z_]\w*")
_ROWS = (
    ("nodes", NodeRow),
    ("ports", PortRow),
    ("actions", Action),
    ("fix_sources", FixSource),
    ("gauges", GaugeRow),
)


def wrong_in(part: Part) -> str:
    """The first thing that is wrong in what a part declares; empty if nothing is."""
    return next(_wrong_in(part), "")


def wrong_inputs(kind: type[Node], payloads: Collection[type[Message]]) -> str:
    """What of the inputs and outputs of a class of nodes no part declares; empty if all is declared.

    A base of declared classes (``PoseFix``) stands for those of them that the rig has.
    """
    for each in kind.inputs:
        if not _is_kind(each, Message) or not any(issubclass(payload, each) for payload in payloads):
            return f"receives {_named(each)}, which no part declares as a topic"
    for each in kind.outputs:
        if each not in payloads:
            return f"publishes {_named(each)}, which no part declares as a topic"
    return ""


def check_node(
    title: str,
    key: str,
    vehicle: str,
    node: object,
    payloads: Collection[type[Message]],
    vehicles: Collection[str],
) -> None:
    """Refuse a node that no runner could run.

    Args:
        title: Its part.
        key: As in journals.
        vehicle: Whose it is to be, empty for a node of the rig.
        node: What the part made.
        payloads: Every declared payload class.
        vehicles: Of the rig.

    Raises:
        UsageError: One sentence with part, node and topic.
    """
    where = f"{title}: node {key!r}"
    if not isinstance(node, Node):
        raise UsageError(f"{where} is made as {node!r:.80}, expected a Node")
    if not hasattr(node, "vehicle") or not hasattr(node, "tick_period_ns"):
        raise UsageError(
            f"{where} lacks what Node gives it: its __init__ must call super().__init__(vehicle)"
        )
    if node.vehicle != vehicle:
        raise UsageError(f"{where} is made for the vehicle {node.vehicle!r:.80}, expected {vehicle!r}")
    period_ns = node.tick_period_ns
    if not _is_count(period_ns) or 0 < period_ns < SHORTEST_TICK_NS:
        raise UsageError(
            f"{where}: tick_period_ns is {period_ns!r:.80}, expected whole nanoseconds, "
            f"0 for no ticks or {SHORTEST_TICK_NS} and more"
        )
    for each in (*node.inputs, *node.outputs):
        if each not in payloads:
            does = "receives" if each in node.inputs else "publishes"
            raise UsageError(f"{where} {does} {_named(each)}, which no part declares as a topic")
    for each in node.paced:
        if each not in node.inputs or not each.TOPIC.pace_ns:
            raise UsageError(
                f"{where} takes {_named(each)} paced, which is none of its inputs or has no pace"
            )
    for each in node.inputs:
        with calling(title, f"sources of node {key!r}"):
            sources = tuple(node.sources(each))
        for source in sources:
            if source and source not in vehicles:
                raise UsageError(
                    f"{where} receives {each.TOPIC.noun} of a vehicle {source!r:.80}, "
                    f"which the rig does not have (it has {', '.join(vehicles)})"
                )
            if node.takes_paced(each, source) and not each.TOPIC.pace_ns:
                raise UsageError(f"{where} takes {each.TOPIC.noun} of {source!r} paced, which has no pace")


def _wrong_in(part: Part) -> Iterator[str]:
    if not is_name(part.name):
        yield f"its name is {part.name!r:.80}, expected {LOOKS}"
    if not isinstance(part.summary, str):
        yield f"its summary is {part.summary!r:.80}, expected a line of text"
    for place in ("topics", "figures", *(name for name, _ in _ROWS)):
        if not isinstance(getattr(part, place), tuple):
            yield f"{place} is {getattr(part, place)!r:.80}, expected a tuple"
            return
    for kind in part.topics:
        yield from _wrong_topic(kind)
    for place, row_class in _ROWS:
        for row in getattr(part, place):
            if not isinstance(row, row_class):
                yield f"{place} holds {row!r:.80}, expected {row_class.__name__}"
                return
    for row in part.nodes:
        yield from _wrong_node(row)
    for port in part.ports:
        if not _is_kind(port.kind, Port) or not callable(port.make):
            yield f"a port of node {port.node!r:.80} is {port.kind!r:.80}, expected a Port and what makes it"
    for place in ("rig", "mock_up", "vehicle"):
        section = getattr(part, place)
        if section is not None and not _is_kind(section, Section):
            yield f"{place} is {section!r:.80}, expected a Section"
    for call in (part.check, *part.figures):
        if not callable(call):
            yield f"{call!r:.80} stands where it is called: expected a function or a class"


def _wrong_topic(kind: type[Message]) -> Iterator[str]:
    if not _is_kind(kind, Message):
        yield f"topics holds {kind!r:.80}, expected a class of Message"
        return
    topic = getattr(kind, "TOPIC", None)
    if not isinstance(topic, Topic):
        yield f"{kind.__name__}.TOPIC is {topic!r:.80}, expected a Topic"
        return
    if not is_name(topic.noun):
        yield f"the topic of {kind.__name__} is named {topic.noun!r:.80}, expected {LOOKS}"
    rate_hz = topic.rate_hz
    if isinstance(rate_hz, bool) or not isinstance(rate_hz, int | float) or not 0.0 <= rate_hz < math.inf:
        yield f"topic {topic.noun!r} comes {rate_hz!r:.80} times a second, expected a number from 0 up"
    if not _is_count(topic.pace_ns):
        yield f"topic {topic.noun!r}: pace_ns is {topic.pace_ns!r:.80}, expected whole nanoseconds from 0 up"
    if not isinstance(kind.ROS_TYPE, str) or not _ROS_TYPE.fullmatch(kind.ROS_TYPE):
        yield f"topic {topic.noun!r}: ROS_TYPE is {kind.ROS_TYPE!r:.80}, expected package/msg/Name"

    for field in fields(kind)[2:]:  # behind the header
        ros_type = get_args(field.type)[1] if get_origin(field.type) is Annotated else None
        if not isinstance(ros_type, str) or not _FIELD.fullmatch(ros_type):
            where = f"topic {topic.noun!r}: field {field.name!r}"
            yield f"{where} is {field.type!r:.80}, expected a type of messages such as F64"


def _wrong_node(row: NodeRow) -> Iterator[str]:
    where = f"node {row.name!r:.80}"
    if not is_name(row.name):
        yield f"a node is named {row.name!r:.80}, expected {LOOKS}"
    if not isinstance(row.weight, Weight):
        yield f"{where}: weight is {row.weight!r:.80}, expected a Weight"
    is_later = isinstance(row.kind, str) and _LATER.fullmatch(row.kind) is not None
    if not is_later and not _is_kind(row.kind, Node):
        yield f"{where}: kind is {row.kind!r:.80}, expected a class of Node or 'module:Class'"
    if not isinstance(row.process, str) and not callable(row.process):
        yield f"{where}: process is {row.process!r:.80}, expected a name or a function"
    calls: tuple[Callable[..., object], ...] = (row.make, row.condition)
    if not all(map(callable, calls)):
        yield f"{where}: make and condition are called, found {row.make!r:.80} and {row.condition!r:.80}"


def _is_kind(given: object, base: type) -> bool:
    return isinstance(given, type) and issubclass(given, base)


def _is_count(given: object) -> bool:
    return isinstance(given, int) and not isinstance(given, bool) and given >= 0


def _named(kind: object) -> str:
    return kind.__name__ if isinstance(kind, type) else f"{kind!r:.80}"
