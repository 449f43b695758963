"""Parts together: a name that two of them take is refused with both."""

from dataclasses import dataclass
from typing import ClassVar

import pytest

from groundstation.bus.journal import Journal
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node, NodeRow, Weight
from groundstation.declarations.part import Part
from groundstation.declarations.port import Port, PortRow
from groundstation.declarations.request import Action
from groundstation.declarations.tables import PartError, Tables
from groundstation.declarations.topic import Topic


@dataclass(frozen=True, slots=True, eq=False)
class Rain(Message):
    TOPIC: ClassVar = Topic("rain")


@dataclass(frozen=True, slots=True, eq=False)
class OtherRain(Message):
    TOPIC: ClassVar = Topic("rain")


@dataclass(frozen=True, slots=True, eq=False)
class RivalOfTheJournal(Message):
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


@pytest.mark.parametrize(
    ("one", "two", "complaint"),
    [
        ({"topics": (Rain,)}, {"topics": (OtherRain,)}, "'one' and part 'two' both declare topic 'rain'"),
        (
            {"nodes": (row("eye"),)},
            {"nodes": (row("eye"),)},
            "'one' and part 'two' both declare node 'eye'",
        ),
        ({"topics": (RivalOfTheJournal,)}, {}, "the runners and part 'one' both declare topic"),
        (
            {},
            {"ports": (PortRow("nobody", Port, lambda rig, vehicle: None),)},
            "a node 'nobody', which no part",
        ),
        ({}, {"actions": (Action("hop", "nobody", ""),)}, "'hop' is answered by 'nobody', which no part"),
    ],
)
def test_parts_that_contradict_each_other_are_refused_by_name(one, two, complaint):
    with pytest.raises(PartError, match=complaint):
        Tables([Part("one", "", **one), Part("two", "", **two)], topics=(Journal,))


def test_two_parts_of_one_name_are_refused():
    with pytest.raises(PartError, match="2 parts are named 'one'"):
        Tables([Part("one", ""), Part("one", "")])
