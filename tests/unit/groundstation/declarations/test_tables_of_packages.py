"""Parts together: a name that two of them take is refused with both."""

from dataclasses import dataclass
from typing import ClassVar

from groundstation.bus.journal import Journal
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node, NodeRow, Weight
from groundstation.declarations.part import Part
from groundstation.declarations.tables import Tables
from groundstation.declarations.topic import Topic


@dataclass(frozen=True, slots=True, eq=False)
class Rain(Message):
    ROS_TYPE: ClassVar[str] = "test/msg/Rain"
    TOPIC: ClassVar = Topic("rain")


@dataclass(frozen=True, slots=True, eq=False)
class OtherRain(Message):
    ROS_TYPE: ClassVar[str] = "test/msg/Rain"
    TOPIC: ClassVar = Topic("rain")


@dataclass(frozen=True, slots=True, eq=False)
class RivalOfTheJournal(Message):
    ROS_TYPE: ClassVar[str] = "test/msg/Rival"
    TOPIC: ClassVar = Topic("journal")


def row(name):
    return NodeRow(name, "station", Weight.LIGHT, Node, lambda rig, vehicle: None)


def test_parts_add_up():
    tables = Tables(
        [Part("one", "", topics=(Rain,)), Part("two", "", nodes=(row("gauge"),))], topics=(Journal,)
    )
    assert list(tables.payloads) == ["journal", "rain"]
    assert list(tables.nodes) == ["gauge"]
    assert tables.owner(Rain) == "one"
    assert tables.owner(Journal) == ""
