"""What a person picks to look at, ``alpha/state.position_table_m[0]``: a topic of an owner, fields, elements.

The names are those of the bus and of recordings; a wrong one is answered with those that are near.
"""

import difflib
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from groundstation.bus.cdr import codec_of, ros_fields
from groundstation.bus.record_stream import Recorded
from groundstation.bus.zenoh_bus import RIG_OWNER
from groundstation.declarations.errors import UsageError
from groundstation.declarations.message import Message
from groundstation.declarations.topic import Scope

STAMP = "stamp_s"
_ELEMENT = re.compile(r"(?P<name>\w+)(\[(?P<index>\d{1,4})\])?")
_NEAR, _LIKENESS = 4, 0.5


@dataclass(frozen=True, slots=True)
class Column:
    """A field, or one element of it.

    Attributes:
        name: As it is shown.
        field: Of the message.
        index: Of the element; None for the whole field.
    """

    name: str
    field: str
    index: int | None

    def value(self, message: Message) -> object:
        """What the message has; None where its sequence is too short."""
        found: Any = getattr(message, self.field)
        if self.index is None:
            return found
        return found[self.index] if self.index < len(found) else None


@dataclass(frozen=True, slots=True)
class Pick:
    """A topic of an owner, and what of it is looked at.

    Attributes:
        kind: Payload class.
        owner: Vehicle or process; empty for the rig.
        columns: In order.
    """

    kind: type[Message]
    owner: str
    columns: tuple[Column, ...]

    def message(self, recorded: Recorded) -> Message | None:
        """The message, where it belongs to what is picked.

        Raises:
            CodecError: It does not fit the layout of its class.
        """
        if recorded.noun != self.kind.TOPIC.noun:
            return None
        by_process = self.kind.TOPIC.scope is Scope.PROCESS
        if recorded.owner != self.owner and not by_process:
            return None
        message = codec_of(self.kind).decode(recorded.data)
        return message if self.owner in (recorded.owner, message.vehicle) else None


def picked(asked: str, payloads: Mapping[str, type[Message]], vehicles: Iterable[str]) -> Pick:
    """Read what is asked for.

    Args:
        asked: ``owner/topic``, and behind a dot a field; topics of the rig stand alone or behind ``rig/``.
        payloads: Payload classes by noun.
        vehicles: Names of those that there are.

    Raises:
        UsageError: There is no such topic, vehicle or field; the text names near ones.
    """
    name, dot, field = asked.partition(".")
    owner, _, noun = name.removeprefix("/").rpartition("/")
    owner = "" if owner == RIG_OWNER else owner
    known = tuple(vehicles)
    kind = payloads.get(noun)
    scope = kind.TOPIC.scope if kind is not None else None
    fits = {Scope.VEHICLE: owner in known, Scope.RIG: not owner, Scope.PROCESS: bool(owner)}
    if kind is None or scope is None or not fits[scope]:
        raise UsageError(f"there is no topic {name!r}{_near(name, topic_names(payloads, known))}")
    return Pick(kind, owner, tuple(_columns(kind, name, field if dot else None)))


def topic_names(payloads: Mapping[str, type[Message]], vehicles: Iterable[str]) -> list[str]:
    """All topics as they are picked; those of processes by the vehicle that their messages are about."""
    names = []
    for noun, kind in payloads.items():
        if kind.TOPIC.scope is Scope.RIG:
            names.append(noun)
        else:
            names += [f"{vehicle}/{noun}" for vehicle in vehicles]
    return sorted(names)


def field_names(kind: type[Message]) -> list[str]:
    """Fields that can be picked of a class."""
    return [name for name, _ in ros_fields(kind)]


def _columns(kind: type[Message], topic: str, asked: str | None) -> Iterator[Column]:
    types = dict(ros_fields(kind))
    if asked is None:
        for name in types:
            yield from _of_field(name, types[name])
        return
    match = _ELEMENT.fullmatch(asked)
    name = match["name"] if match else asked
    if match is None or name not in types:
        raise UsageError(f"{topic} has no field {name!r}{_near(name, types)}")
    length = _length(types[name])
    if match["index"] is None:
        yield from _of_field(name, types[name])
        return
    index = int(match["index"])
    if length is None or (length and index >= length):
        what = "no list" if length is None else f"a list of {length}, counted from 0"
        raise UsageError(f"{topic}.{name} is {what}: there is no {asked!r}")
    yield Column(asked, name, index)


def _of_field(name: str, ros_type: str) -> Iterator[Column]:
    """A column of a field, or one for each element of a list of fixed length."""
    length = _length(ros_type)
    if not length:
        yield Column(name, name, None)
        return
    for index in range(length):
        yield Column(f"{name}[{index}]", name, index)


def _length(ros_type: str) -> int | None:
    """Of a list; 0 for one of any length, None for a single value."""
    _, bracket, rest = ros_type.partition("[")
    return int(rest[:-1] or 0) if bracket else None


def _near(asked: str, names: Iterable[str]) -> str:
    listed = list(names)
    noun = asked.rpartition("/")[2]
    same = [name for name in listed if noun and name.rpartition("/")[2] == noun]  # of another owner
    found = (same or difflib.get_close_matches(asked, listed, _NEAR, _LIKENESS) or listed)[:_NEAR]
    return f": near it are {', '.join(found)}" if found else ""


def shown(value: object, *, exact: bool) -> str:
    """A value as text.

    Args:
        value: Of a field.
        exact: So that it can be read back; else six digits.
    """
    if value is None:
        return ""
    if isinstance(value, bytes):
        return value.hex()
    if isinstance(value, str):
        return value
    if isinstance(value, tuple | np.ndarray):
        return " ".join(shown(item, exact=exact) for item in value)
    if isinstance(value, float | np.floating):
        return repr(float(value)) if exact else f"{value:.6g}"
    return str(value)


def stamp_text(stamp_ns: int) -> str:
    """A stamp in seconds, to the nanosecond."""
    seconds, nanoseconds = divmod(stamp_ns, 1_000_000_000)
    return f"{seconds}.{nanoseconds:09d}"
