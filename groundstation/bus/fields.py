"""Numbers of messages by their names: ``alpha/state.position_table_m[0]``.

What the charts of the console, exports and plots speak of: every field of every topic that is a number.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from groundstation.bus.cdr_fields import ros_fields
from groundstation.declarations.message import Message

NUMBERS = frozenset({"bool", "uint8", "uint16", "uint32", "uint64", "int64", "float32", "float64"})


@dataclass(frozen=True, slots=True)
class Field:
    """One number of a topic of an owner.

    Attributes:
        owner: Vehicle or process, empty for the rig.
        noun: Of the topic.
        name: Of the field of its payload class.
        place: Of the number, where the field is an array; None for a scalar.
    """

    owner: str
    noun: str
    name: str
    place: int | None

    def __str__(self) -> str:
        place = "" if self.place is None else f"[{self.place}]"
        return f"{self.owner or 'rig'}/{self.noun}.{self.name}{place}"


def fields_of(kind: type[Message], owner: str) -> Iterator[Field]:
    """The numbers of a topic that have a fixed place, in the order of the payload.

    Fields behind a sequence of texts are left out: they have no fixed place in many payloads at once.
    """
    for name, ros_type in ros_fields(kind):
        base, bracket, rest = ros_type.partition("[")
        if base == "string" and bracket:
            return
        if base not in NUMBERS:
            continue
        if not bracket:
            yield Field(owner, kind.TOPIC.noun, name, None)
        elif count := rest.rstrip("]"):
            for place in range(int(count)):
                yield Field(owner, kind.TOPIC.noun, name, place)
