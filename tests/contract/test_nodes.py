"""Contracts over the node table: who says what, who hears it, and that nobody peeks at truth."""

from pathlib import Path

import pytest
from groundstation.bus.topics import TOPICS, topic_of
from groundstation.rig.plan import make_node
from groundstation.runners.step import build_slots
from groundstation.runtime.node_table import NODES, Weight, key_of, process_of
from groundstation.runtime.ports import ports_of

from groundstation.bus.journal import Journal, JournalWriter
from groundstation.declarations.request import ACTIONS
from groundstation.declarations.topic import Recorded, Scope
from groundstation.parts.operation.messages import Diagnostics, Latency
from groundstation.rig.plan import gives_way, processes_of
from groundstation.rig.read import load_rig
from groundstation.runners.slot import Sequences

RIG_FILES = sorted((Path(__file__).parents[2] / "examples" / "rigs").glob("*.toml"))
RIGS = {path.stem: load_rig(path) for path in RIG_FILES}
OBSERVERS = {"reference_reader"}  # turns truth into a topic; says nothing that a node of the loop hears

rigs = pytest.mark.parametrize("rig", RIGS.values(), ids=RIGS.keys())


@pytest.fixture(scope="module")
def nodes():
    """Every node of every example, by rig and key."""
    return {name: nodes_of(rig) for name, rig in RIGS.items()}


def nodes_of(rig):
    keys = [key_of(row, vehicle) for row in NODES for vehicle in row.vehicles(rig)]
    return {key: make_node(rig, key) for key in keys}


def said_by(found):
    return {(kind.TOPIC, node.vehicle) for node in found.values() for kind in node.outputs}


def test_a_row_of_the_node_table_has_a_name_of_its_own():
    names = [row.name for row in NODES]
    assert len(names) == len(set(names))
    assert {row.answered_by for row in ACTIONS.values()} <= set(names)


@pytest.mark.parametrize("name", RIGS)
def test_what_a_node_hears_and_says_has_a_topic(name, nodes):
    for key, node in nodes[name].items():
        assert node.inputs, key
        for kind in (*node.inputs, *node.outputs):
            assert kind.TOPIC.payload is kind, key


@pytest.mark.parametrize("name", RIGS)
def test_a_topic_of_a_vehicle_has_one_publisher(name, nodes):
    publishers = {}
    for key, node in nodes[name].items():
        for kind in node.outputs:
            if kind.TOPIC.scope is Scope.VEHICLE:
                publishers.setdefault((kind.TOPIC.noun, node.vehicle), []).append(key)
    for port in ports_of(RIGS[name]):
        publishers.setdefault((topic_of(port.reads).noun, port.vehicle), []).append(port.channel)
    assert {where: who for where, who in publishers.items() if len(who) > 1} == {}


@pytest.mark.parametrize("name", RIGS)
def test_truth_is_heard_by_observers_only(name, nodes):
    for key, node in nodes[name].items():
        for kind in node.inputs:
            if kind.TOPIC.observers_only:
                assert key.rpartition("/")[2] in OBSERVERS
                assert all(said.TOPIC.observers_only for said in node.outputs)


@pytest.mark.parametrize("name", RIGS)
def test_what_a_node_hears_is_said_by_somebody(name, nodes):
    said = said_by(nodes[name]) | {(topic_of(port.reads), port.vehicle) for port in ports_of(RIGS[name])}
    nouns = {topic.noun for topic, _ in said} | {"request"}  # operators ask, too
    for key, node in nodes[name].items():
        for kind in node.inputs:
            is_heard = kind.TOPIC.scope is Scope.RIG or node.vehicles_heard(kind)
            assert kind.TOPIC.noun in nouns or not is_heard, f"{key} waits for {kind.__name__} for ever"


def test_every_topic_is_said_in_some_example(nodes):
    said = {topic for found in nodes.values() for topic, _ in said_by(found)}
    said |= {topic_of(port.reads) for rig in RIGS.values() for port in ports_of(rig)}
    said |= {kind.TOPIC for kind in (Journal, Diagnostics, Latency)}  # of the runner
    assert {topic.noun for topic in TOPICS} == {topic.noun for topic in said}


def test_every_topic_is_kept_or_heard(nodes):
    heard = {kind.TOPIC for found in nodes.values() for node in found.values() for kind in node.inputs}
    for topic in TOPICS:
        assert topic.recorded is Recorded.ALWAYS or topic in heard


@pytest.mark.parametrize("name", RIGS)
def test_what_leaves_through_a_port_is_said_by_a_node_of_the_same_process(name, nodes):
    rig = RIGS[name]
    homes = {key_of(row, v): process_of(rig, row, v) for row in NODES for v in row.vehicles(rig)}
    for port in ports_of(rig):
        for kind, vehicle in port.writes():
            makers = [k for k, n in nodes[name].items() if kind in n.outputs and n.vehicle == vehicle]
            assert [homes[key] for key in makers] == [port.process]


@rigs
def test_no_process_holds_a_heavy_node_beside_an_urgent_one(rig):
    held = {}
    for row in NODES:
        for vehicle in row.vehicles(rig):
            held.setdefault(process_of(rig, row, vehicle), set()).add(row.weight)
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
