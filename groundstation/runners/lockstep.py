"""The lockstep runner: virtual time, a heap of events, deterministic by seed, as fast as the CPU allows.

Order of events: by stamp; at equal stamps messages by (row of the topic table, order of publication),
then ticks. Nodes take no time unless the rig says so (``busy_s``, ``late_s``). The laboratory is
advanced to the stamp of whatever comes next and what it hands over becomes messages through the ports.
"""

import heapq
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Protocol

from drivers.laboratory import Laboratory
from groundstation.bus.envelope import Delivered, Envelope
from groundstation.bus.journal import JournalWriter, Kind
from groundstation.bus.topics import topic_of
from groundstation.messages.base import Message
from groundstation.messages.definitions import Journal
from groundstation.runtime.ports import PortTranslation
from groundstation.runtime.slot import Dispatch, NodeSlot, Sequences, owner_of
from groundstation.runtime.turns import Turns

PROCESS = "lockstep"
JOURNAL_PERIOD_NS = 100_000_000
_TICK_ROW = 1 << 20  # after every topic


@dataclass(frozen=True, slots=True)
class _Free:
    """A busy node is free again."""

    slot: NodeSlot


_Event = Delivered | NodeSlot | _Free | None
"""A message to deliver, a node to tick, a node that is free, or the journal to publish."""


class Observer(Protocol):
    """Sees every published message in order, e.g. the recorder or the report."""

    def __call__(self, delivered: Delivered, now_ns: int) -> None:
        """Take one message; ``now_ns`` is the virtual moment of its publication."""


class LockstepRunner:
    """Runs nodes against a laboratory in virtual time.

    Args:
        slots: Nodes in the order of the node table.
        laboratory: Anything that implements ``Laboratory``.
        ports: Translations of the laboratory's channels, by channel.
        observers: Called for each published message.
        journal: Shared with the slots.
        sequences: Shared with the slots.
    """

    def __init__(
        self,
        slots: list[NodeSlot],
        laboratory: Laboratory,
        ports: Iterable[PortTranslation],
        observers: Iterable[Observer],
        journal: JournalWriter,
        sequences: Sequences,
    ) -> None:
        self._slots = slots
        self._laboratory = laboratory
        self._ports = {port.channel: port for port in ports}
        self._writers = {
            (topic_of(kind).index, vehicle): port
            for port in self._ports.values()
            for kind, vehicle in port.writes()
        }
        self._observers = tuple(observers)
        self._journal = journal
        self._sequences = sequences
        self._dispatch = Dispatch(slots)
        self._turns = Turns(self._publish, self._call_back)
        self._heap: list[tuple[int, int, int, _Event]] = []
        self._count = 0
        self._arrival_ns: int | None = None
        self._arrival_known = False
        self.now_ns = 0

    def run(self, duration_ns: int, progress: Callable[[int], None] | None = None) -> None:
        """Run for ``duration_ns`` of virtual time; may be called again to go on."""
        until_ns = self.now_ns + duration_ns
        if self.now_ns == 0:
            self._begin()
        report_ns = 0
        laboratory = self._laboratory
        while True:
            next_ns = self._heap[0][0] if self._heap else until_ns
            if not self._arrival_known:
                self._arrival_ns, self._arrival_known = laboratory.next_arrival_ns(), True
            arrival_ns = self._arrival_ns
            if arrival_ns is not None and arrival_ns <= min(next_ns, until_ns):
                self._arrival_known = False
                for arrival in laboratory.advance(arrival_ns):
                    self._arrive(arrival.channel, arrival.stamp_ns, arrival.data)
                continue
            if next_ns > until_ns or not self._heap:
                break
            stamp_ns, _, _, what = heapq.heappop(self._heap)
            self.now_ns = stamp_ns
            if isinstance(what, Delivered):
                self._deliver(what, stamp_ns)
            elif what is None:
                self._publish_journal(stamp_ns)
            elif isinstance(what, _Free):
                self._turns.free(what.slot, stamp_ns)
            else:
                self._tick(what, stamp_ns)
            if progress is not None and stamp_ns >= report_ns:
                progress(stamp_ns)
                report_ns = stamp_ns + 250_000_000
        self._arrival_known = False
        for arrival in laboratory.advance(until_ns):
            self._arrive(arrival.channel, arrival.stamp_ns, arrival.data)
        self.now_ns = until_ns
        self._publish_journal(until_ns, again=False)

    def close(self) -> None:
        """Release the laboratory."""
        self._laboratory.close()

    def _begin(self) -> None:
        for slot in self._slots:
            self._publish(slot.start(0))
            if slot.node.tick_period_ns:
                self._push(slot.node.tick_period_ns, _TICK_ROW, slot)
        self._push(JOURNAL_PERIOD_NS, _TICK_ROW + 1, None)

    def _push(self, stamp_ns: int, row: int, what: _Event) -> None:
        self._count += 1
        heapq.heappush(self._heap, (stamp_ns, row, self._count, what))

    def _arrive(self, channel: str, stamp_ns: int, data: object) -> None:
        port = self._ports.get(channel)
        if port is None:
            return
        payload = port.to_message(stamp_ns, data)
        topic = topic_of(type(payload))
        owner = owner_of(topic, payload, PROCESS)
        sequence = self._sequences.next(topic, owner)
        self._journal.note(Kind.PORT, None, topic.index, owner, sequence, stamp_ns)
        self._push(stamp_ns, topic.index, Delivered(Envelope(topic, owner, sequence, stamp_ns), payload))

    def _publish(self, messages: Iterable[Delivered]) -> None:
        for delivered in messages:
            envelope = delivered.envelope
            self._push(envelope.publish_ns, envelope.topic.index, delivered)

    def _deliver(self, delivered: Delivered, now_ns: int) -> None:
        topic = delivered.envelope.topic
        for observe in self._observers:
            observe(delivered, now_ns)
        port = self._writers.get((topic.index, delivered.payload.vehicle))
        if port is not None:
            self._arrival_known = False  # what is sent in may bring something out earlier
            self._laboratory.deliver(now_ns, port.channel, port.to_device(delivered.payload))
        for slot in self._dispatch.hearers(topic, delivered.payload):
            self._turns.offer(slot, delivered, now_ns)

    def _call_back(self, stamp_ns: int, slot: NodeSlot) -> None:
        self._push(stamp_ns, _TICK_ROW, _Free(slot))

    def _tick(self, slot: NodeSlot, now_ns: int) -> None:
        self._publish(slot.tick(now_ns))
        self._push(now_ns + slot.node.tick_period_ns, _TICK_ROW, slot)

    def _publish_journal(self, now_ns: int, *, again: bool = True) -> None:
        if len(self._journal):
            names, entries = self._journal.take()
            payload: Message = Journal(now_ns, "", PROCESS, names, entries)
            topic = topic_of(Journal)
            envelope = Envelope(topic, PROCESS, self._sequences.next(topic, PROCESS), now_ns)
            for observe in self._observers:
                observe(Delivered(envelope, payload), now_ns)
        if again:
            self._push(now_ns + JOURNAL_PERIOD_NS, _TICK_ROW + 1, None)
