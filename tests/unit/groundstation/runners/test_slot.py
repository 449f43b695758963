"""A node in its slot: what it publishes names what triggered it, and everything stands in the journal."""

import pytest

from groundstation.bus.envelope import Cause, Delivered, Envelope
from groundstation.bus.journal import Entry, Journal, JournalWriter, Kind, read_entries
from groundstation.declarations.errors import NodeError
from groundstation.declarations.node import Node
from groundstation.parts.control.messages import Wrench
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.operation.messages import Diagnostics
from groundstation.parts.valves.messages import ValveDemand
from groundstation.runners.slot import Sequences, Slot, Timing


def state(vehicle="alpha", sequence=1):
    payload = VehicleState(5, vehicle, (0.0, 0.0), 0.0, (0.0, 0.0), 0.0, (1e-3,) * 3, "flying", 0)
    return Delivered(Envelope(VehicleState.TOPIC, vehicle, sequence, 5), payload)


def demand(sequence=1):
    payload = ValveDemand(5, "alpha", bytes(8), "controller", (0.0, 0.0), 0.0, "", (0.0, 0.0), 0.0)
    return Delivered(Envelope(ValveDemand.TOPIC, "alpha", sequence, 5), payload)


STATE = VehicleState.TOPIC.noun
DEMAND = ValveDemand.TOPIC.noun
WRENCH = Wrench.TOPIC.noun


class Follower(Node):
    """Receives the states of two vehicles and answers each demand; says something of itself in its ticks."""

    inputs = (VehicleState, ValveDemand)
    outputs = (Wrench, Diagnostics)
    trigger = VehicleState

    def __init__(self):
        super().__init__("alpha", 10)

    def sources(self, payload):
        return ("alpha", "bravo") if payload is VehicleState else ("alpha",)

    def start(self, now_ns):
        yield Diagnostics(now_ns, "", "follower", 0, "starting", (), ())

    def receive(self, message, now_ns):
        if isinstance(message, ValveDemand):
            yield self.wrench(now_ns)
            yield self.wrench(now_ns)

    def tick(self, now_ns):
        yield self.wrench(now_ns)

    def stop(self, now_ns):
        yield self.wrench(now_ns)

    def wrench(self, now_ns):
        return Wrench(now_ns, "alpha", 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Reporter(Follower):
    trigger = None


def slot_of(node, *, measure=False, timing=None):
    return Slot(
        "alpha/follower",
        node,
        "alpha_flight",
        JournalWriter(),
        Sequences(),
        measure=measure,
        timing=timing or Timing(),
    )


def journaled(slot):
    return list(read_entries(Journal(0, "", "alpha_flight", *slot.journal.take())))


def test_what_a_node_answers_was_triggered_by_what_it_answers():
    slot = slot_of(Follower())
    slot.receive(state("alpha", 4), 10)
    slot.receive(state("bravo", 9), 11)
    made = slot.receive(demand(2), 12)
    assert [each.envelope.trigger for each in made] == [Cause(DEMAND, "alpha", 2)] * 2
    assert [each.envelope.sequence for each in made] == [1, 2]


def test_a_tick_was_triggered_by_the_newest_of_the_nodes_own_trigger_whatever_came_since():
    slot = slot_of(Follower())
    slot.receive(state("alpha", 3), 10)
    slot.receive(state("alpha", 4), 11)
    slot.receive(demand(1), 12)
    slot.receive(state("bravo", 900), 13)  # a neighbour's state is newer, and is none of its own
    (made,) = slot.tick(20)
    assert made.envelope.trigger == Cause(STATE, "alpha", 4)


def test_a_neighbours_message_on_the_triggers_topic_triggers_no_tick():
    slot = slot_of(Follower())
    slot.receive(state("bravo", 4), 10)
    assert slot.tick(15)[0].envelope.trigger is None
    slot.receive(state("alpha", 4), 16)
    assert slot.tick(20)[0].envelope.trigger == Cause(STATE, "alpha", 4)


def test_a_tick_before_the_trigger_came_was_triggered_by_nothing():
    slot = slot_of(Follower())
    assert slot.tick(5)[0].envelope.trigger is None
    slot.receive(demand(7), 10)
    assert slot.tick(20)[0].envelope.trigger is None


def test_a_tick_of_a_node_without_a_trigger_was_triggered_by_nothing():
    slot = slot_of(Reporter())
    slot.receive(demand(7), 10)
    slot.receive(state("alpha", 2), 11)
    assert slot.tick(20)[0].envelope.trigger is None


def test_a_topic_of_a_process_belongs_to_the_process_and_one_of_a_vehicle_to_the_vehicle():
    slot = slot_of(Follower())
    (started,) = slot.start(3)
    (wrench,) = slot.tick(4)
    assert (started.envelope.owner, wrench.envelope.owner) == ("alpha_flight", "alpha")
    assert (started.envelope.trigger, started.envelope.sequence) == (None, 1)


def test_the_journal_names_what_the_node_consumed_and_published():
    slot = slot_of(Follower())
    slot.start(3)
    slot.receive(state("bravo", 9), 4)
    slot.receive(demand(2), 5)
    slot.tick(6)
    slot.drop(demand(3).envelope, 7)
    slot.stop(8)
    key = "alpha/follower"
    assert journaled(slot) == [
        Entry(3, Kind.START, key, "", "alpha_flight", 0, 0),
        Entry(3, Kind.OUTPUT, key, "diagnostics", "alpha_flight", 1, 0),
        Entry(4, Kind.INPUT, key, STATE, "bravo", 9, 0),
        Entry(5, Kind.INPUT, key, DEMAND, "alpha", 2, 0),
        Entry(5, Kind.OUTPUT, key, WRENCH, "alpha", 1, 0),
        Entry(5, Kind.OUTPUT, key, WRENCH, "alpha", 2, 0),
        Entry(6, Kind.TICK, key, "", "alpha_flight", 0, 0),
        Entry(6, Kind.OUTPUT, key, WRENCH, "alpha", 3, 0),
        Entry(7, Kind.DROP, key, DEMAND, "alpha", 3, 0),
        Entry(8, Kind.STOP, key, "", "alpha_flight", 0, 0),
        Entry(8, Kind.OUTPUT, key, WRENCH, "alpha", 4, 0),
    ]


def test_emulated_time_delays_what_is_published_and_not_when_the_node_was_told():
    slot = slot_of(Follower(), timing=Timing(busy_ns=100, late_ns=20))
    (made,) = slot.tick(1000)
    assert (made.envelope.publish_ns, made.payload.stamp_ns) == (1120, 1000)


def test_what_a_call_cost_is_measured_only_where_it_is_asked_for():
    costs = [each.tick(5)[0].envelope for each in (slot_of(Follower()), slot_of(Follower(), measure=True))]
    assert (costs[0].wall_ns, costs[0].publish_ns) == (0, 5)
    assert costs[1].wall_ns > 0
    assert costs[1].publish_ns == 5 + costs[1].wall_ns


def test_a_message_that_is_not_among_a_nodes_outputs_is_refused_by_name():
    class Wrong(Follower):
        outputs = (Diagnostics,)

    with pytest.raises(NodeError, match="alpha/follower published Wrench, which is not among its outputs"):
        slot_of(Wrong()).tick(5)


def test_slots_of_one_process_share_its_numbers():
    journal, sequences = JournalWriter(), Sequences(after=41)
    slots = [Slot(f"alpha/{n}", Follower(), "p", journal, sequences, measure=False) for n in ("a", "b")]
    assert [slot.tick(5)[0].envelope.sequence for slot in (*slots, *slots)] == [42, 43, 44, 45]
    assert sequences.next(Wrench.TOPIC, "alpha") == 46
    assert sequences.next(Wrench.TOPIC, "bravo") == 42
