"""What a part declares wrongly is refused in one sentence that names it, before anything flies."""

from dataclasses import dataclass, make_dataclass, replace
from pathlib import Path
from typing import Annotated, ClassVar

import pytest

from groundstation.declarations.errors import RigError, UsageError
from groundstation.declarations.message import F64, I64, Message
from groundstation.declarations.node import Node, NodeRow, Weight
from groundstation.declarations.part import Part
from groundstation.declarations.port import Port, PortRow
from groundstation.declarations.tables import PartError, Tables
from groundstation.declarations.topic import Topic
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.table import own_tables
from groundstation.rig.overview import overview
from groundstation.rig.plan import make_node, nodes_of
from groundstation.rig.read import parse_rig
from groundstation.runners.make_runner import make_runner

RIG = Path(__file__).parents[4] / "examples" / "rigs" / "drawn_fixes.toml"
OURS = tuple(own_tables().parts.values())
JOURNAL = (own_tables().payloads["journal"],)


@dataclass(frozen=True, slots=True, eq=False)
class Rain(Message):
    ROS_TYPE: ClassVar[str] = "pack_msgs/msg/Rain"
    TOPIC: ClassVar = Topic("rain", 10.0)
    level_m: F64


@dataclass(frozen=True, slots=True, eq=False)
class Stray(Message):
    ROS_TYPE: ClassVar[str] = "pack_msgs/msg/Stray"
    TOPIC: ClassVar = Topic("stray")
    level_m: F64


@dataclass(frozen=True, slots=True, eq=False)
class Rival(Message):
    ROS_TYPE: ClassVar[str] = "pack_msgs/msg/Rain"
    TOPIC: ClassVar = Topic("rival")
    level_counts: I64


NAMES = {"TOPIC": Topic("rain"), "ROS_TYPE": "pack_msgs/msg/Rain"}


WRONG_FIELDS = {"dict": dict, "float": float, "float99": Annotated[float, "float99"], "text": "F64"}


def with_field(kind):
    """A class with a field of a type."""
    return make_dataclass("Rain", [("v", kind)], bases=(Message,), namespace=NAMES, frozen=True)


def rain(topic=None, ros_type=None):
    """A class like ``Rain`` with another topic or type."""
    names = {"TOPIC": topic or Topic("rain"), "ROS_TYPE": ros_type or "pack_msgs/msg/Rain"}
    return type("Rain", (Rain,), {"__slots__": (), **names})


class Gauge(Node):
    inputs = (VehicleState,)
    outputs = (Rain,)

    def receive(self, message, now_ns):
        return ()


class Inlet(Port):
    reads = Rain

    def to_message(self, stamp_ns, data):
        return Rain(stamp_ns, self.vehicle, 0.0)

    def open(self):
        raise NotImplementedError  # declarations are checked here, and nothing is opened


def node(**changes):
    row = NodeRow("gauge", "{vehicle}_rain", Weight.LIGHT, Gauge, lambda rig, vehicle: Gauge(vehicle))
    return replace(row, **changes)


def part(**changes):
    return replace(Part("weather", "rain", topics=(Rain,), nodes=(node(),), package="pack"), **changes)


def kind(**attributes):
    return type("Gauge", (Gauge,), attributes)


def fails(*_):
    raise KeyError("x")


def leaves(*_):
    raise SystemExit(0)


def refuses(*_):
    raise ValueError("just a text")


DECLARED = {
    **{
        f"a noun {noun!r}": (part(topics=(rain(Topic(noun)),)), f"the topic of Rain is named {noun!r}")
        for noun in ("a/b", "a*", "", "a b", "#", "A", "ä", 5, None)
    },
    **{
        f"a rate of {rate}": (part(topics=(rain(Topic("rain", rate)),)), f"topic 'rain' comes {rate!r} times")
        for rate in (-3.0, float("nan"), float("inf"), "10", True)
    },
    **{
        f"a pace of {pace}": (part(topics=(rain(Topic("rain", pace_ns=pace)),)), f"pace_ns is {pace!r}")
        for pace in (-1, 1.5, True)
    },
    **{
        f"a ROS type {name!r}": (part(topics=(rain(ros_type=name),)), f"ROS_TYPE is {name!r}")
        for name in ("nonsense", "a/msg/", "/msg/B", "a/B", "a/srv/B", "a/msg/b", "a b/msg/B", 7)
    },
    **{
        f"a field of type {name}": (part(topics=(with_field(kind),)), "topic 'rain': field 'v' is ")
        for name, kind in WRONG_FIELDS.items()
    },
    "a topic that is no message": (part(topics=(int,)), "topics holds <class 'int'>"),
    "topics that are no tuple": (part(topics=Rain), "topics is <class"),
    "a message without its topic": (part(topics=(Message,)), "Message.TOPIC is None"),
    "one ROS type for two layouts": (
        part(topics=(Rain, Rival)), "'rain' and 'rival' both have the ROS_TYPE 'pack_msgs/msg/Rain'",
    ),
    **{
        f"a part named {name!r}": (part(name=name), f"its name is {name!r}") for name in ("", "a/b", "A b", 5)
    },
    "no summary": (part(summary=None), "its summary is None"),
    "a rig section that is none": (part(rig=int), "rig is <class 'int'>, expected a Section"),
    "a vehicle section that is none": (part(vehicle=5), "vehicle is 5, expected a Section"),
    "a check that is none": (part(check=5), "5 stands where it is called"),
    "a figure that is none": (part(figures=(5,)), "5 stands where it is called"),
    "a gauge that is none": (part(gauges=(5,)), "gauges holds 5, expected GaugeRow"),
    "a node that is no row": (part(nodes=(Gauge,)), "nodes holds <class"),
    **{
        f"a node named {name!r}": (part(nodes=(node(name=name),)), f"a node is named {name!r}")
        for name in ("", "a/b", "a b", 5)
    },
    "a weight that is none": (part(nodes=(node(weight="light"),)), "node 'gauge': weight is 'light'"),
    **{
        f"a kind {kind!r}": (part(nodes=(node(kind=kind),)), f"node 'gauge': kind is {kind!r}")
        for kind in (int, "nowhere", "a b:C", None, 5)
    },
    "a process that is none": (part(nodes=(node(process=5),)), "node 'gauge': process is 5"),
    "a make that is none": (part(nodes=(node(make=None),)), "make and condition are called, found None"),
    "an input of nobody": (part(nodes=(node(kind=kind(inputs=(Stray,))),)), "node 'gauge' receives Stray"),
    "an input that is none": (part(nodes=(node(kind=kind(inputs=(int,))),)), "node 'gauge' receives int"),
    "an output of nobody": (part(nodes=(node(kind=kind(outputs=(Stray,))),)), "node 'gauge' publishes Stray"),
    "a port that is none": (
        part(ports=(PortRow("gauge", int, fails),)), "a port of node 'gauge' is <class 'int'>",
    ),
    "a port that reads for nobody": (
        part(ports=(PortRow("gauge", type("In", (Inlet,), {"reads": Stray}), fails),)),
        "the port of node 'gauge' reads",
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", DECLARED)
def test_what_a_part_declares_wrongly_is_refused_with_the_tables(what):
    wrong, sentence = DECLARED[what]
    with pytest.raises(PartError) as refused:
        Tables((*OURS, wrong), JOURNAL)
    assert sentence in str(refused.value)
    assert "\n" not in str(refused.value)
    if "both have" not in sentence:
        assert str(refused.value).startswith(f"the part {wrong.name!r} of the package pack: ")


def made(node_class=Gauge, period_ns=0, **attributes):
    """A row whose node turns out other than its class says."""

    def make(rig, vehicle):
        node = node_class(vehicle, period_ns)
        for name, value in attributes.items():
            setattr(node, name, value)
        return node

    return part(nodes=(node(make=make),))


def port(make, **changes):
    return part(ports=(PortRow("gauge", Inlet, make, **changes),))


NODE = "the part 'weather' of the package pack: node 'alpha/gauge' "
CALLED = {
    "a negative period": (made(period_ns=-5), "tick_period_ns is -5"),
    "a period that is a float": (made(period_ns=1e8), "tick_period_ns is 100000000.0"),
    "a period that is a bool": (made(period_ns=True), "tick_period_ns is True"),
    "a tick each nanosecond": (made(period_ns=1), "tick_period_ns is 1, expected"),
    "another vehicle": (made(vehicle="beta"), f"{NODE}is made for the vehicle 'beta', expected 'alpha'"),
    "no vehicle at all": (made(vehicle=None), f"{NODE}is made for the vehicle None, expected 'alpha'"),
    "a base that is forgotten": (
        made(kind(__init__=lambda self, vehicle, period_ns: None)), f"{NODE}lacks what Node gives it",
    ),
    "an input of nobody": (made(inputs=(Stray,)), f"{NODE}receives Stray"),
    "an output of nobody": (made(outputs=(Stray,)), f"{NODE}publishes Stray"),
    "an output of another part": (
        part(nodes=(node(kind=kind(outputs=(VehicleState,))),)),
        "'alpha/fusion' of the part 'fusion' and node 'alpha/gauge'",
    ),
    "a pace that there is none": (
        made(kind(paced=(VehicleState,), inputs=(Rain,))), f"{NODE}takes VehicleState",
    ),
    "a vehicle that there is none": (
        made(kind(sources=lambda self, payload: ("nobody",))), f"{NODE}receives state of a vehicle 'nobody'",
    ),
    "sources that raise": (made(kind(sources=fails)), "sources of node 'alpha/gauge' raised KeyError: 'x'"),
    "a node that is none": (part(nodes=(node(make=lambda rig, vehicle: None),)), "is made as None"),
    "a node of another class": (
        part(nodes=(node(kind="groundstation.parts.fusion.fusion:Fusion"),)), "node 'alpha/gauge' is a Gauge",
    ),
    "a class of nowhere": (
        part(nodes=(node(kind="nowhere:K"),)), "raised ModuleNotFoundError: No module named",
    ),
    "a class that is not there": (part(nodes=(node(kind="json:K"),)), "raised AttributeError: module 'json'"),
    "a make that raises": (part(nodes=(node(make=fails),)), "make of node 'gauge' raised KeyError: 'x'"),
    "a make that leaves": (part(nodes=(node(make=leaves),)), "make of node 'gauge' raised SystemExit: 0"),
    "a make that refuses": (
        part(nodes=(node(make=refuses),)), "the part 'weather' of the package pack: just a text",
    ),
    "a condition that raises": (
        part(nodes=(node(condition=fails),)), "condition of node 'gauge' raised KeyError",
    ),
    "a process that raises": (part(nodes=(node(process=fails),)), "process of node 'gauge' raised KeyError"),
    "a process that is none": (
        part(nodes=(node(process=lambda *_: None),)), "process of node 'gauge' raised ",
    ),
    "a check that raises": (part(check=fails), "check raised KeyError: 'x'"),
    "a check that leaves": (part(check=leaves), "check raised SystemExit: 0"),
    "a check that refuses": (part(check=refuses), "the part 'weather' of the package pack: just a text"),
    "a port that raises": (port(fails), "make of the port of node 'gauge' raised KeyError: 'x'"),
    "a port that is none": (port(lambda *_: 5), "the port of node 'gauge' is made as 5, expected a Port"),
    "a port beside a node": (
        port(lambda rig, vehicle: Inlet("alpha/rain", vehicle, "laboratory:x")),
        "of the part 'weather' of the package pack and port 'alpha/rain' both publish rain",
    ),
    "a port without a reader": (
        part(
            nodes=(node(condition=lambda *_: False),),
            ports=(PortRow("gauge", Inlet, lambda *_: Inlet("rain", "", "laboratory:x"), is_of_rig=True),),
        ),
        "the part 'weather' of the package pack: rain is read by 'gauge', which no vehicle has",
    ),
}  # fmt: skip


@pytest.mark.parametrize("use", [overview, make_runner], ids=["parts", "lockstep"])
@pytest.mark.parametrize("what", CALLED)
def test_what_a_part_does_wrongly_for_a_rig_is_refused_by_every_command(what, use):
    wrong, sentence = CALLED[what]
    tables = Tables((*OURS, wrong), JOURNAL)
    with pytest.raises((UsageError, ValueError)) as refused:
        use(parse_rig(RIG.read_text(), RIG, tables=tables))
    assert sentence in str(refused.value)
    assert "the part 'weather' of the package pack" in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_part_that_is_right_flies():
    rig = parse_rig(RIG.read_text(), RIG, tables=Tables((*OURS, part()), JOURNAL))
    make_runner(rig).run(10_000_000)
    assert {row.noun: row.publishers for row in overview(rig).rows}["rain"] == ("gauge",)
    assert isinstance(make_node(rig, "alpha/gauge"), Gauge)
    assert "alpha_rain" in {placed.process for placed in nodes_of(rig)}


def test_a_check_that_names_its_key_is_cited_as_it_is():
    def check(rig):
        raise ValueError("vehicles.alpha.rain: is too wet")

    with pytest.raises(RigError) as refused:
        parse_rig(RIG.read_text(), RIG, tables=Tables((*OURS, part(check=check)), JOURNAL))
    assert str(refused.value) == f"{RIG}: vehicles.alpha.rain: is too wet"
