"""Contracts over the nodes and ports of every example: who publishes, who receives, who sees truth."""

from functools import partial
from pathlib import Path

import pytest

from groundstation.bus.journal import Journal, JournalWriter
from groundstation.declarations.message import Message
from groundstation.declarations.node import Weight
from groundstation.declarations.request import Ack, Request
from groundstation.declarations.rig import RecordSection
from groundstation.declarations.topic import Scope
from groundstation.parts.operation.messages import Diagnostics, Latency, RecorderStatus
from groundstation.parts.table import installed_tables
from groundstation.recording.policy import ImagePolicy, is_kept
from groundstation.rig.plan import gives_way, make_node, nodes_of, ports_of, processes_of
from groundstation.rig.read import load_rig, parse_rig
from groundstation.runners.slot import Sequences
from groundstation.runners.step import build_slots
from groundstation.scenario.loading import load

RIG_FILES = sorted((Path(__file__).parents[2] / "examples" / "rigs").glob("*.toml"))
SCENARIO = Path(__file__).parents[2] / "examples" / "scenarios" / "go_to.toml"
RIGS = {path.stem: load_rig(path) for path in RIG_FILES} | {"scenario": load(SCENARIO).rig}
PAYLOADS = installed_tables().payloads
# one turns truth into a topic, the other asks the laboratory for failures and sees them begin
OBSERVERS = {"reference_reader", "failure_desk"}

rigs = pytest.mark.parametrize("rig", RIGS.values(), ids=RIGS.keys())
names = pytest.mark.parametrize("name", RIGS)


@pytest.fixture(scope="module")
def nodes():
    """Every node of every example, by rig and key."""
    return {
        name: {placed.key: make_node(rig, placed.key) for placed in nodes_of(rig)}
        for name, rig in RIGS.items()
    }


def published_by(found):
    return {(kind, node.vehicle) for node in found.values() for kind in node.outputs}


@names
def test_what_a_node_receives_and_publishes_is_a_topic_of_some_part(name, nodes):
    for key, node in nodes[name].items():
        assert node.inputs, key
        for kind in (*node.inputs, *node.outputs):
            assert issubclass(kind, Message)
            assert PAYLOADS[kind.TOPIC.noun] is kind, key


@names
def test_what_triggers_a_node_in_its_ticks_is_one_of_its_inputs(name, nodes):
    for key, node in nodes[name].items():
        if node.trigger is not None:
            assert node.trigger in node.inputs, key
            assert node.tick_period_ns > 0, f"{key} is never ticked"


@names
def test_what_a_node_takes_paced_is_one_of_its_inputs_and_has_a_pace(name, nodes):
    for key, node in nodes[name].items():
        for kind in node.paced:
            assert kind in node.inputs, key
            assert kind.TOPIC.pace_ns > 0, key
        for kind in node.inputs:
            assert kind.TOPIC.pace_ns > 0 or not any(map(partial(node.takes_paced, kind), node.sources(kind)))


@names
def test_a_topic_of_a_vehicle_has_one_publisher(name, nodes):
    publishers = {}
    for key, node in nodes[name].items():
        for kind in node.outputs:
            if kind.TOPIC.scope is Scope.VEHICLE:
                publishers.setdefault((kind.TOPIC.noun, node.vehicle), []).append(key)
    for port, _ in ports_of(RIGS[name]):
        publishers.setdefault((port.reads.TOPIC.noun, port.vehicle), []).append(port.channel)
    assert {where: who for where, who in publishers.items() if len(who) > 1} == {}


@names
def test_truth_is_received_by_observers_only(name, nodes):
    for key, node in nodes[name].items():
        if any(kind.TOPIC.observers_only for kind in node.inputs):
            assert key.rpartition("/")[2] in OBSERVERS
            for made in node.outputs:
                assert made.TOPIC.observers_only or is_answer_or_order(made, nodes[name]), f"{key}: {made}"


def is_answer_or_order(kind, found):
    """It answers whoever asked, or leaves for the laboratory: no node of the loop receives it."""
    return kind is Ack or not any(kind in node.inputs for node in found.values())


def test_truth_arrives_in_some_example(nodes):
    """The contract above looks at something."""
    assert any(
        kind.TOPIC.observers_only
        for found in nodes.values()
        for node in found.values()
        for kind in node.inputs
    )


@names
def test_what_a_node_receives_is_published_by_somebody(name, nodes):
    published = published_by(nodes[name]) | {(port.reads, port.vehicle) for port, _ in ports_of(RIGS[name])}
    kinds = {kind for kind, _ in published} | {
        Request,
        RecorderStatus,
    }  # operators ask, too, and the recorder reports
    for key, node in nodes[name].items():
        for kind in node.inputs:
            is_received = kind.TOPIC.scope is Scope.RIG or node.sources(kind)
            assert kind in kinds or not is_received, f"{key} waits for {kind.__name__} for ever"


def test_every_topic_is_published_in_some_example(nodes):
    published = {kind for found in nodes.values() for kind, _ in published_by(found)}
    published |= {port.reads for rig in RIGS.values() for port, _ in ports_of(rig)}
    published |= {Journal, Diagnostics, Latency, Request, RecorderStatus}  # of the runner
    tables = installed_tables()
    used = {placed.row.name for rig in RIGS.values() for placed in nodes_of(rig)}
    idle = {
        part.name
        for part in tables.parts.values()
        if part.nodes and used.isdisjoint(row.name for row in part.nodes)
    }
    assert idle <= {"motion_capture"}  # no example has such a system
    assert {kind for kind in PAYLOADS.values() if tables.owner(kind) not in idle} == published


def test_every_topic_is_kept_or_received(nodes):
    received = {kind for found in nodes.values() for node in found.values() for kind in node.inputs}
    for kind in PAYLOADS.values():
        assert is_kept(kind.TOPIC, ImagePolicy.SPOTS) or kind in received
    assert (
        ImagePolicy(RecordSection().images) is ImagePolicy.SPOTS
    )  # what a rig keeps unless it says otherwise


@names
def test_what_leaves_through_a_port_is_published_by_a_node_of_the_same_process(name, nodes):
    rig = RIGS[name]
    homes = {placed.key: placed.process for placed in nodes_of(rig)}
    for port, process in ports_of(rig):
        for kind, vehicle in port.writes():
            makers = [
                key for key, node in nodes[name].items() if kind in node.outputs and node.vehicle == vehicle
            ]
            assert [homes[key] for key in makers] == [process]


def readers_of(rig, port):
    """Processes of the nodes that the port's row names as its readers."""
    (row,) = [row for row in rig.tables.ports if type(port) is row.kind]
    return {placed.process for placed in nodes_of(rig) if placed.row.name == row.node}


def receives(node, port):
    return port.reads in node.inputs and (
        port.reads.TOPIC.scope is Scope.RIG or port.vehicle in node.sources(port.reads)
    )


@names
def test_a_port_lives_where_the_node_lives_that_receives_what_arrives(name, nodes):
    rig = RIGS[name]
    homes = {placed.key: placed.process for placed in nodes_of(rig)}
    for port, process in ports_of(rig):
        receivers = [key for key, node in nodes[name].items() if receives(node, port)]
        row = next(row for row in rig.tables.ports if type(port) is row.kind)
        assert row.node in {key.rpartition("/")[2] for key in receivers} or port.reads.TOPIC.observers_only
        assert process in readers_of(rig, port)
        own = [key for key in receivers if key.rpartition("/")[2] == row.node]
        assert all(homes[key] == process for key in own)


MOVED = [
    (name, row.node)
    for name, rig in RIGS.items()
    if name != "scenario"  # has no rig file of its own
    for row in rig.tables.ports
    if rig.tables.nodes[row.node].vehicles(rig)
]


@pytest.mark.parametrize(("name", "node"), MOVED, ids=[f"{name}-{node}" for name, node in MOVED])
def test_a_port_moves_with_its_node_to_another_process(name, node):
    """A rig that gives a node another process does not blind or deafen the vehicle."""
    path = next(path for path in RIG_FILES if path.stem == name)
    is_of_rig = RIGS[name].tables.nodes[node].is_of_rig
    process = "elsewhere" if is_of_rig else "{vehicle}_elsewhere"
    text = path.read_text()
    section = f"[nodes.{node}]\n"
    more = f'process = "{process}"\n'
    text = text.replace(section, section + more) if section in text else f"{text}\n{section}{more}"
    moved = parse_rig(text, path)
    (row,) = [row for row in moved.tables.ports if row.node == node]
    channels = [(port.channel, port.vehicle) for port, _ in ports_of(RIGS[name]) if type(port) is row.kind]
    found = [(port, home) for port, home in ports_of(moved) if type(port) is row.kind]
    assert [(port.channel, port.vehicle) for port, _ in found] == channels
    for port, home in found:
        assert home in {placed.process for placed in nodes_of(moved) if placed.row.name == node}
        if not row.is_of_rig:
            assert home == process.replace("{vehicle}", port.vehicle)
        assert home in processes_of(moved)


@rigs
def test_no_process_holds_a_heavy_node_beside_an_urgent_one(rig):
    held = {}
    for placed in nodes_of(rig):
        held.setdefault(placed.process, set()).add(placed.row.weight)
    assert not [name for name, weights in held.items() if {Weight.HEAVY, Weight.URGENT} <= weights]
    assert processes_of(rig)[0] == "commands"
    assert set(processes_of(rig)) == set(held)
    assert {name for name in held if gives_way(rig, name)} == {
        n for n, w in held.items() if Weight.HEAVY in w
    }


@rigs
def test_the_processes_together_hold_every_node_once(rig):
    keys = []
    for process in processes_of(rig):
        keys += [slot.key for slot in build_slots(rig, process, JournalWriter(), Sequences())]
    everything = build_slots(rig, None, JournalWriter(), Sequences())
    assert sorted(keys) == sorted(slot.key for slot in everything)
    assert len(keys) == len(set(keys))
