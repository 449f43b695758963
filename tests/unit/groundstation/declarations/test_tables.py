"""Tables are the parts' rows put together; what does not fit is refused by name."""

from dataclasses import dataclass
from typing import ClassVar

import pytest

from groundstation.declarations.fix import FixSource, PoseFix
from groundstation.declarations.message import Bool, Message
from groundstation.declarations.node import Node, NodeRow, Weight
from groundstation.declarations.part import Part
from groundstation.declarations.port import Port, PortRow
from groundstation.declarations.request import Action
from groundstation.declarations.tables import PartError, Tables
from groundstation.declarations.topic import Topic


@dataclass(frozen=True, slots=True, eq=False)
class Beat(Message):
    ROS_TYPE: ClassVar[str] = "test/msg/Beat"
    TOPIC: ClassVar = Topic("beat")
    strong: Bool


@dataclass(frozen=True, slots=True, eq=False)
class OtherBeat(Message):
    ROS_TYPE: ClassVar[str] = "test/msg/OtherBeat"
    TOPIC: ClassVar = Topic("beat")
    strong: Bool


class Heart(Node):
    outputs = (Beat,)

    def receive(self, message, now_ns):
        return ()


def row(name="heart"):
    return NodeRow(name, "station", Weight.LIGHT, Heart, lambda rig, vehicle: Heart(vehicle))


def part(name="pulse", **rows):
    return Part(name, "a beating heart", **rows)


def test_rows_of_all_parts_stand_together_in_their_order():
    tables = Tables([part("one", nodes=(row("a"), row("b")), topics=(Beat,)), part("two", nodes=(row("c"),))])
    assert list(tables.nodes) == ["a", "b", "c"]
    assert list(tables.parts) == ["one", "two"]
    assert tables.payloads == {"beat": Beat}
    assert (tables.owner(Beat), tables.owner(OtherBeat)) == ("one", "")


def test_topics_of_the_runners_belong_to_no_part():
    tables = Tables([part()], topics=(Beat,))
    assert tables.payloads == {"beat": Beat}
    assert tables.owner(Beat) == ""


ACTION = Action("skip", "heart", "leave one beat out")
SOURCE = FixSource("heart", PoseFix, lambda rig, vehicle: True, lambda rig, vehicle: (0.0, 0.0), "a heart")


@pytest.mark.parametrize(
    ("parts", "sentence"),
    [
        ([part(), part()], "two parts are named 'pulse'"),
        (
            [part(topics=(Beat,)), part("b", topics=(OtherBeat,))],
            "the parts 'pulse' and 'b' both declare the topic 'beat'",
        ),
        ([part(topics=(Beat, Beat))], "the part 'pulse' declares the topic 'beat' twice"),
        (
            [part(nodes=(row(),)), part("b", nodes=(row(),))],
            "the parts 'pulse' and 'b' both declare the node 'heart'",
        ),
        (
            [part(nodes=(row(),), actions=(ACTION, ACTION))],
            "the part 'pulse' declares the action 'skip' twice",
        ),
        ([part(fix_sources=(SOURCE, SOURCE))], "the part 'pulse' declares the fix source 'heart' twice"),
        ([part(actions=(ACTION,))], "action 'skip' is answered by 'heart', which no part declares"),
        (
            [part(ports=(PortRow("heart", Port, lambda rig, vehicle: None),))],
            "a port is read by a node 'heart', which no part declares",
        ),
    ],
)
def test_what_does_not_fit_is_refused_by_name(parts, sentence):
    with pytest.raises(PartError) as refused:
        Tables(parts)
    assert str(refused.value) == sentence


def test_a_topic_of_the_runners_cannot_be_declared_again():
    with pytest.raises(PartError, match="'pulse' declares the topic 'beat', which is the runners' own"):
        Tables([part(topics=(OtherBeat,))], topics=(Beat,))


def test_a_node_is_imported_where_it_is_used():
    later = NodeRow("json", "station", Weight.LIGHT, f"{__name__}:Heart", lambda rig, vehicle: Heart(vehicle))
    assert isinstance(later.kind, str)
    lazy = NodeRow("x", "station", Weight.LIGHT, "groundstation.parts.imu.imu_reader:ImuReader", later.make)
    assert lazy.node_class().__name__ == "ImuReader"
    assert row().node_class() is Heart
