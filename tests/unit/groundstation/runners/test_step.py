"""The step: who receives what, busy nodes, ports; the same for every runner."""

import math
from dataclasses import dataclass, field

import pytest

from groundstation.bus.envelope import Delivered, Envelope
from groundstation.bus.journal import Journal, JournalWriter, Kind, read_entries
from groundstation.declarations.node import Node
from groundstation.declarations.port import Edge, Port
from groundstation.declarations.request import Request
from groundstation.declarations.topic import Delivery, Scope
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.imu.messages import ImuBytes, ImuOrder
from groundstation.parts.stars.messages import StarImage, StarMatches
from groundstation.parts.valves.messages import CanIn
from groundstation.runners.slot import Sequences, Slot, Timing
from groundstation.runners.step import Step, inputs_of

MS = 1_000_000
PROCESS = "alpha_sky"


class Taker(Node):
    """Keeps what it receives, with the moments."""

    outputs = (ImuOrder,)

    def __init__(self, vehicle, *inputs, sources=None, answers=False):
        super().__init__(vehicle)
        self.inputs = inputs
        self._sources = sources or (vehicle,)
        self._answers = answers
        self.taken = []
        self.began = self.ended = None

    def sources(self, payload):
        return self._sources

    def start(self, now_ns):
        self.began = now_ns
        return ()

    def receive(self, message, now_ns):
        self.taken.append((now_ns, message))
        if self._answers:
            yield ImuOrder(now_ns, self.vehicle, b"!")

    def stop(self, now_ns):
        self.ended = now_ns
        yield ImuOrder(now_ns, self.vehicle, b"bye")


@dataclass(frozen=True)
class Line(Port):
    """A line of bytes that takes orders."""

    reads = ImuBytes

    def to_message(self, stamp_ns, data):
        return ImuBytes(stamp_ns, self.vehicle, data, math.nan)

    def writes(self):
        return ((ImuOrder, self.vehicle),)

    def open(self) -> Edge:
        raise NotImplementedError


@dataclass
class Transport:
    """Keeps what the step asks for."""

    published: list = field(default_factory=list)
    calls: list = field(default_factory=list)
    written: list = field(default_factory=list)

    def publish(self, delivered):
        self.published.append(delivered)

    def call_back(self, stamp_ns, slot):
        self.calls.append((stamp_ns, slot))

    def write(self, port, payload, now_ns):
        self.written.append((port.channel, payload.data, now_ns))


class Bench:
    """A step with its nodes, on a bench."""

    def __init__(self, *nodes, ports=(), busy_s=0.0):
        self.journal, sequences = JournalWriter(), Sequences()
        self.slots = [
            Slot(
                f"{node.vehicle}/taker_{place}",
                node,
                PROCESS,
                self.journal,
                sequences,
                False,
                Timing(round(busy_s * 1e9)),
            )
            for place, node in enumerate(nodes)
        ]
        self.transport = Transport()
        self.step = Step(PROCESS, self.slots, ports, self.journal, sequences, self.transport)

    def entries(self, *kinds):
        found = read_entries(Journal(0, "", PROCESS, *self.journal.take()))
        return [(e.kind, e.node, e.noun, e.owner, e.sequence) for e in found if e.kind in kinds]


def delivered(payload, sequence=1):
    topic = payload.TOPIC
    owner = "desk" if topic.scope is Scope.PROCESS else payload.vehicle
    return Delivered(Envelope(topic, owner, sequence, payload.stamp_ns), payload)


def image(stamp_ns, vehicle="alpha"):
    return StarImage(stamp_ns, vehicle, 0, 1, 1, "mono8", 1, b"x")


def state(stamp_ns):
    return VehicleState(stamp_ns, "alpha", (0.0, 0.0), 0.0, (0.0, 0.0), 0.0, (0.0, 0.0, 0.0), "flying", 0)


def request(stamp_ns):
    return Request(stamp_ns, "alpha", 1, "operator", "picture", "")


def stamps(node):
    return [(now_ns, message.stamp_ns) for now_ns, message in node.taken]


def test_a_node_receives_the_topics_of_its_sources_and_no_others():
    node = Taker("alpha", StarImage, sources=("alpha", "bravo"))
    bench = Bench(node)
    for vehicle in ("alpha", "bravo", "charlie"):
        bench.step.deliver(delivered(image(5, vehicle)), 6)
    bench.step.deliver(delivered(request(5)), 6)
    assert [message.vehicle for _, message in node.taken] == ["alpha", "bravo"]


def test_who_takes_a_topic_paced_receives_the_first_of_each_period_the_others_all():
    class PacedTaker(Taker):
        paced = (VehicleState,)

    slow, fast = PacedTaker("alpha", VehicleState), Taker("alpha", VehicleState)
    bench = Bench(slow, fast)
    assert not bench.step.is_paced(("state", "alpha"))
    assert Bench(PacedTaker("alpha", VehicleState)).step.is_paced(("state", "alpha"))
    for stamp_ms in (1, 5, 19, 20, 24, 61, 79, 80):
        bench.step.deliver(delivered(state(stamp_ms * MS)), stamp_ms * MS)
    assert [now_ns // MS for now_ns, _ in slow.taken] == [1, 20, 61, 80]
    assert len(fast.taken) == 8


def test_a_node_may_take_a_topic_of_one_vehicle_paced_and_that_of_another_not():
    class HalfPaced(Taker):
        def takes_paced(self, payload, source):
            return payload is VehicleState and source == "bravo"

    bench = Bench(HalfPaced("alpha", VehicleState, sources=("alpha", "bravo")))
    assert bench.step.is_paced(("state", "bravo"))
    assert not bench.step.is_paced(("state", "alpha"))


def test_what_belongs_to_the_whole_rig_is_received_by_nodes_of_vehicles():
    node = Taker("alpha", CanIn)
    assert list(inputs_of(node)) == [(CanIn, ("can_in", ""))]
    bench = Bench(node)
    bench.step.deliver(delivered(CanIn(5, "", 0x181, b"", 1)), 6)
    assert len(node.taken) == 1


def test_nodes_receive_in_the_order_in_which_they_were_given():
    order = []

    class Ordered(Taker):
        def receive(self, message, now_ns):
            order.append(self)
            return ()

    nodes = [Ordered("alpha", StarImage) for _ in range(4)]
    Bench(*nodes).step.deliver(delivered(image(5)), 6)
    assert order == nodes


def test_all_nodes_are_started_and_each_gives_its_last_messages():
    nodes = [Taker("alpha", StarImage), Taker("bravo", StarImage)]
    bench = Bench(*nodes)
    bench.step.start(3)
    for slot in bench.slots:
        bench.step.stop(slot, 9)
    assert [(node.began, node.ended) for node in nodes] == [(3, 9)] * 2
    assert [(each.payload.vehicle, each.payload.data) for each in bench.transport.published] == [
        ("alpha", b"bye"),
        ("bravo", b"bye"),
    ]


# -- busy nodes -----------------------------------------------------------------------------------


def run(bench, messages, until_ns):
    """Deliver at their stamps, and call the step back when it asked for it; messages come first at a tie."""
    waiting = sorted(messages, key=lambda message: message.stamp_ns)
    for now_ns in range(0, until_ns, MS):
        while waiting and waiting[0].stamp_ns <= now_ns:
            message = waiting.pop(0)
            bench.step.deliver(delivered(message, message.stamp_ns // MS), now_ns)
        for stamp_ns, slot in [call for call in bench.transport.calls if call[0] <= now_ns]:
            bench.transport.calls.remove((stamp_ns, slot))
            bench.step.free(slot, now_ns)


def test_a_busy_node_takes_one_at_a_time_in_order():
    node = Taker("alpha", StarMatches, Request)
    bench = Bench(node, busy_s=0.010)
    run(bench, [request(t * MS) for t in (1, 2, 3)], 50 * MS)
    assert stamps(node) == [(1 * MS, 1 * MS), (11 * MS, 2 * MS), (21 * MS, 3 * MS)]


def test_of_a_topic_with_newest_delivery_only_the_last_one_waits_for_a_busy_node():
    assert StarImage.TOPIC.delivery is Delivery.NEWEST
    node = Taker("alpha", StarImage)
    bench = Bench(node, busy_s=0.010)
    run(bench, [image(t * MS) for t in (1, 2, 3, 4)], 50 * MS)
    assert stamps(node) == [(1 * MS, 1 * MS), (11 * MS, 4 * MS)]
    assert bench.entries(Kind.DROP) == [
        (Kind.DROP, "alpha/taker_0", "star_image", "alpha", number) for number in (2, 3)
    ]


def test_a_picture_that_is_replaced_takes_no_request_with_it():
    node = Taker("alpha", StarImage, Request)
    bench = Bench(node, busy_s=0.010)
    run(bench, [image(1 * MS), request(2 * MS), image(3 * MS), image(4 * MS)], 50 * MS)
    assert [type(message) for _, message in node.taken] == [StarImage, Request, StarImage]
    assert stamps(node)[-1] == (21 * MS, 4 * MS)


def test_pictures_of_two_vehicles_do_not_replace_each_other():
    node = Taker("alpha", StarImage, sources=("alpha", "bravo"))
    bench = Bench(node, busy_s=0.010)
    run(bench, [image(1 * MS), image(2 * MS), image(3 * MS, "bravo"), image(4 * MS)], 60 * MS)
    assert [message.vehicle for _, message in node.taken] == ["alpha", "bravo", "alpha"]


def test_what_arrives_as_the_node_becomes_free_waits_behind_what_has_waited():
    node = Taker("alpha", Request)
    bench = Bench(node, busy_s=0.010)
    run(bench, [request(t * MS) for t in (1, 2, 11)], 60 * MS)
    assert stamps(node) == [(1 * MS, 1 * MS), (11 * MS, 2 * MS), (21 * MS, 11 * MS)]


def test_a_node_that_was_free_takes_one_of_two_that_arrive_together():
    node = Taker("alpha", Request)
    bench = Bench(node, busy_s=0.010)
    run(bench, [request(t * MS) for t in (1, 11, 11)], 60 * MS)
    assert [now_ns for now_ns, _ in node.taken] == [1 * MS, 11 * MS, 21 * MS]


def test_a_busy_node_holds_up_no_other():
    busy, free = Taker("alpha", Request), Taker("alpha", Request)
    bench = Bench(busy, free)
    bench.slots[0].timing.busy_ns = 10 * MS
    run(bench, [request(t * MS) for t in (1, 2)], 30 * MS)
    assert [now_ns for now_ns, _ in busy.taken] == [1 * MS, 11 * MS]
    assert [now_ns for now_ns, _ in free.taken] == [1 * MS, 2 * MS]


# -- ports ----------------------------------------------------------------------------------------


@pytest.fixture
def line():
    return Line("alpha/imu", "alpha", "laboratory:alpha/imu")


def test_what_arrives_at_a_port_is_published_with_a_number_and_journaled(line):
    bench = Bench(Taker("alpha", ImuBytes), ports=[line])
    for stamp_ns in (4, 6):
        bench.step.arrive(line, stamp_ns, b"abc", stamp_ns + 1)
    assert [
        (d.envelope.owner, d.envelope.sequence, d.payload.stamp_ns) for d in bench.transport.published
    ] == [
        ("alpha", 1, 4),
        ("alpha", 2, 6),
    ]
    assert bench.entries(Kind.PORT) == [(Kind.PORT, "", "imu_bytes", "alpha", number) for number in (1, 2)]


def test_what_a_port_writes_leaves_through_it_and_reaches_nodes_too(line):
    node = Taker("alpha", ImuOrder)
    bench = Bench(node, ports=[line])
    bench.step.deliver(delivered(ImuOrder(5, "alpha", b"go")), 6)
    bench.step.deliver(delivered(ImuOrder(5, "bravo", b"no")), 7)
    assert bench.transport.written == [("alpha/imu", b"go", 6)]
    assert [message.data for _, message in node.taken] == [b"go"]


def test_a_message_of_another_process_is_received_and_leaves_through_no_port(line):
    node = Taker("alpha", ImuOrder)
    bench = Bench(node, ports=[line])
    bench.step.receive(delivered(ImuOrder(5, "alpha", b"go")), 6)
    assert bench.transport.written == []
    assert len(node.taken) == 1


def test_the_journal_is_published_with_numbers_of_its_own_even_when_it_is_empty():
    bench = Bench(Taker("alpha", StarImage))
    first, second = bench.step.take_journal(5), bench.step.take_journal(6)
    assert (first.envelope.owner, first.envelope.sequence, second.envelope.sequence) == (PROCESS, 1, 2)
    assert second.payload.entries == b""
