"""The step that all runners take: start, tick, deliver, arrive, stop, journal, emulated time cost.

A runner supplies a clock and a transport and nothing else: it decides when ``deliver`` is called with what
a node has published, and carries out what the step asks of its ``Transport``.
"""

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Protocol

from groundstation.bus.envelope import Delivered, Envelope
from groundstation.bus.journal import Journal, JournalWriter, Kind
from groundstation.declarations.errors import NodeError
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.declarations.port import Port
from groundstation.declarations.rig import Rig
from groundstation.declarations.topic import Delivery, Pace, Scope
from groundstation.rig.plan import make_nodes
from groundstation.runners.slot import Sequences, Slot, Timing, owner_of

JOURNAL_PERIOD_NS = 100_000_000

Address = tuple[str, str]
"""A topic as nodes receive it: noun, and vehicle of the payload."""

_Taker = tuple[Slot, Pace | None]
"""Who receives a topic, with the pace of who takes it paced."""


class Transport(Protocol):
    """What a runner does for the step."""

    def publish(self, delivered: Delivered) -> None:
        """A message that is to be published at its envelope's stamp."""

    def call_back(self, stamp_ns: int, slot: Slot) -> None:
        """``Step.free`` is to be called with this slot at that stamp."""

    def write(self, port: Port, payload: Message, now_ns: int) -> None:
        """A message that leaves through a port."""


class Step:
    """The nodes and ports of one process, or of a whole rig in lockstep.

    Args:
        process: Name of the process.
        slots: Nodes in the order of the tables.
        ports: Edges that belong here.
        journal: Shared with the slots.
        sequences: Shared with the slots.
        transport: Of the runner.
    """

    def __init__(
        self,
        process: str,
        slots: list[Slot],
        ports: Iterable[Port],
        journal: JournalWriter,
        sequences: Sequences,
        transport: Transport,
    ) -> None:
        self.process = process
        self.slots = slots
        self._journal = journal
        self._sequences = sequences
        self._transport = transport
        self._trouble: NodeError | None = None
        self._receivers: dict[Address, list[Slot]] = {}
        self._takers: dict[Address, list[_Taker]] = {}
        for slot in slots:
            for kind, address in inputs_of(slot.node):
                pace = Pace(kind.TOPIC.pace_ns) if slot.node.takes_paced(kind, address[1]) else None
                self._receivers.setdefault(address, []).append(slot)
                self._takers.setdefault(address, []).append((slot, pace))
        self._writers: dict[Address, Port] = {
            (kind.TOPIC.noun, vehicle): port for port in ports for kind, vehicle in port.writes()
        }

    @property
    def received(self) -> Mapping[Address, list[Slot]]:
        """Everything that nodes receive here."""
        return self._receivers

    def is_paced(self, address: Address) -> bool:
        """Whether all who receive it here take it paced."""
        return all(pace is not None for _, pace in self._takers[address])

    def writer_of(self, payload: Message) -> Port | None:
        """The port that a message leaves through; None where it leaves through none."""
        return self._writers.get((payload.TOPIC.noun, payload.vehicle))

    def start(self, now_ns: int) -> None:
        """Start every node."""
        for slot in self.slots:
            self._publish(slot.start(now_ns))

    def stop(self, slot: Slot, now_ns: int) -> None:
        """Take a node's last messages; what it raises is kept, so that the others are stopped too."""
        is_first = not any(each.has_failed for each in self.slots)
        try:
            self._publish(slot.stop(now_ns))
        except NodeError as error:
            if is_first:  # later ones follow from the first, which has been raised
                self._trouble = error

    def raise_what_stopping_raised(self) -> None:
        """Call once all nodes have been stopped.

        Raises:
            NodeError: One of them raised something, and nothing had failed before.
        """
        if self._trouble is not None:
            raise self._trouble

    def tick(self, slot: Slot, now_ns: int) -> None:
        """Let time pass for a node."""
        self._publish(slot.tick(now_ns))

    def arrive(self, port: Port, stamp_ns: int, data: object, now_ns: int) -> None:
        """Something came in through a port."""
        self.publish(port.to_message(stamp_ns, data), now_ns)

    def publish(self, payload: Message, now_ns: int) -> None:
        """Publish a message that no node made: of a port, or of the runner itself."""
        topic = payload.TOPIC
        owner = owner_of(topic, payload, self.process)
        sequence = self._sequences.next(topic, owner)
        if self._journal.is_kept:
            self._journal.note(Kind.PORT, None, topic.noun, owner, sequence, now_ns)
        self._transport.publish(Delivered(Envelope(topic, owner, sequence, now_ns), payload))

    def deliver(self, delivered: Delivered, now_ns: int) -> None:
        """Give a published message to the port that it leaves through and to the nodes that receive it."""
        payload = delivered.payload
        address = payload.TOPIC.noun, payload.vehicle
        port = self._writers.get(address)
        if port is not None:
            self._transport.write(port, payload, now_ns)
        self._give(address, delivered, now_ns)

    def receive(self, delivered: Delivered, now_ns: int) -> None:
        """Give a message of another process to the nodes that receive it."""
        payload = delivered.payload
        self._give((payload.TOPIC.noun, payload.vehicle), delivered, now_ns)

    def free(self, slot: Slot, now_ns: int) -> None:
        """A busy node is done: it takes what has waited longest."""
        if slot.waiting and slot.busy_until_ns <= now_ns:
            self._hand_over(slot, slot.waiting.pop(0), now_ns)

    def take_journal(self, now_ns: int) -> Delivered:
        """What was journaled since the last call; an empty journal is a sign of life."""
        names, entries = self._journal.take()
        payload = Journal(now_ns, "", self.process, names, entries)
        topic = Journal.TOPIC
        sequence = self._sequences.next(topic, self.process)
        return Delivered(Envelope(topic, self.process, sequence, now_ns), payload)

    def _give(self, address: Address, delivered: Delivered, now_ns: int) -> None:
        publish = self._transport.publish
        for slot, pace in self._takers.get(address, ()):
            if pace is not None and not pace.passes(delivered.envelope.publish_ns):
                continue
            if not slot.timing.busy_ns:
                for made in slot.receive(delivered, now_ns):
                    publish(made)
            elif slot.busy_until_ns <= now_ns and not slot.waiting:
                self._hand_over(slot, delivered, now_ns)
            else:
                self._wait(slot, delivered, now_ns)

    def _wait(self, slot: Slot, delivered: Delivered, now_ns: int) -> None:
        """Let a message wait for a busy node; of a topic with newest delivery only the last one waits."""
        topic, owner = delivered.envelope[:2]
        if topic.delivery is Delivery.NEWEST:
            for place, older in enumerate(slot.waiting):
                if older.envelope[:2] == (topic, owner):
                    slot.drop(slot.waiting.pop(place).envelope, now_ns)
                    break
        slot.waiting.append(delivered)

    def _hand_over(self, slot: Slot, delivered: Delivered, now_ns: int) -> None:
        """Give a message to a node that it keeps busy."""
        made = slot.receive(delivered, now_ns)
        slot.busy_until_ns = now_ns + slot.timing.busy_ns
        self._transport.call_back(slot.busy_until_ns, slot)
        self._publish(made)

    def _publish(self, made: Iterable[Delivered]) -> None:
        publish = self._transport.publish
        for delivered in made:
            publish(delivered)


def inputs_of(node: Node) -> Iterable[tuple[type[Message], Address]]:
    """Topics that a node receives, each with the vehicle of the payload."""
    for kind in node.inputs:
        topic = kind.TOPIC
        for vehicle in ("",) if topic.scope is Scope.RIG else node.sources(kind):
            yield kind, (topic.noun, vehicle)


def build_slots(
    rig: Rig,
    process: str | None,
    journal: JournalWriter,
    sequences: Sequences,
    *,
    name: str = "",
    measure: bool = True,
    replaced: Mapping[str, Node] = MappingProxyType({}),
) -> list[Slot]:
    """Build the nodes of a process, or of all processes if None, in the order of the tables.

    Args:
        rig: The rig.
        process: Name of the process.
        journal: Of the process.
        sequences: Of the process.
        name: What the process is called where it runs all nodes.
        measure: Whether wall times are measured.
        replaced: Nodes that stand in the place of the rig's, by key.

    Raises:
        ValueError: A node refuses its configuration.
        UsageError: A part makes a node that no runner could run.
    """
    slots = []
    for (row, vehicle, _), node in make_nodes(rig, process):
        section = rig.nodes.get(row.name)
        timing = Timing()
        if section is not None:
            timing = Timing(round(section.busy_s * 1e9), round(section.late_s * 1e9))
        key = row.key(vehicle)
        node = replaced.get(key, node)
        home = process or name
        slots.append(Slot(key, node, home, journal, sequences, measure, timing, rig.vehicles))
    return slots
