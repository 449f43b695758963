"""The live runner: one process, one loop, one queue; wall clock and Zenoh.

Threads only read devices or the bus and append to the queue; nodes run in the loop. What nodes of one
process say to each other never leaves it before they have heard it, and goes out on the bus besides.
"""

import heapq
import sys
import threading
import time
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

import zenoh

from groundstation.bus.envelope import Delivered, Envelope
from groundstation.bus.journal import JournalWriter, Kind
from groundstation.bus.topics import TOPICS, Recorded, Scope, topic_named, topic_of
from groundstation.bus.zenoh_bus import ZenohBus, key_of, split_key
from groundstation.messages.base import Message
from groundstation.messages.cdr import CodecError
from groundstation.messages.definitions import Diagnostics, Journal
from groundstation.runtime.live_inbox import FromPort, Inbox, Remote
from groundstation.runtime.live_ports import PortThread
from groundstation.runtime.ports import PortTranslation
from groundstation.runtime.slot import Dispatch, NodeSlot, Sequences, owner_of
from groundstation.runtime.turns import Turns

JOURNAL_PERIOD_NS = 100_000_000
LATCH_PERIOD_NS = 1_000_000_000


@dataclass(slots=True)
class _Ticking:
    """When a node is to be ticked next."""

    slot: NodeSlot
    period_ns: int
    due_ns: int

    def advance(self, now_ns: int) -> None:
        """Keep the grid; after a delay of more than a period leave ticks out rather than crowd them."""
        self.due_ns += self.period_ns
        if self.due_ns <= now_ns:
            self.due_ns = now_ns + self.period_ns


class LiveProcess:
    """Runs the nodes and ports of one process until it is stopped.

    Args:
        process: Its name.
        slots: Its nodes, in the order of the node table.
        ports: Its edges with their addresses resolved.
        bus: Session with the hub.
        journal: Shared with the slots.
        sequences: Shared with the slots.
        publish_images: Whether camera frames go out on the bus (recorded losslessly).
    """

    def __init__(
        self,
        process: str,
        slots: list[NodeSlot],
        ports: Iterable[PortTranslation],
        bus: ZenohBus,
        journal: JournalWriter,
        sequences: Sequences,
        *,
        publish_images: bool,
    ) -> None:
        self._process = process
        self._slots = slots
        self._bus = bus
        self._journal = journal
        self._sequences = sequences
        self._publish_images = publish_images
        self._dispatch = Dispatch(slots)
        self._turns = Turns(self._publish, self._hold)
        self._inbox = Inbox()
        self._stopping = threading.Event()
        self._seen_latched: dict[str, tuple[int, int]] = {}
        self._latched: dict[str, tuple[Envelope, bytes]] = {}
        self._local: deque[Delivered] = deque()
        self._held: list[tuple[int, int, Delivered | NodeSlot]] = []
        self._held_count = 0
        self.undecodable = 0
        self._hub_is_gone = False
        self._threads = [
            PortThread(port, self._from_port, self._port_trouble, self._inbox.fail) for port in ports
        ]
        self._writers = {
            (topic_of(kind).index, vehicle): thread
            for thread in self._threads
            for kind, vehicle in thread.port.writes()
        }

    def stop(self) -> None:
        """Ask the loop to end; safe in a signal handler and from any thread."""
        self._stopping.set()
        self._inbox.wake()

    def run(self) -> None:
        """Run until ``stop``; nodes then have their last words and ports are closed, whatever happened."""
        try:
            self._run()
        finally:
            self._end()

    def _run(self) -> None:
        self._subscribe()
        now_ns = time.monotonic_ns()
        for slot in self._slots:
            self._publish(slot.start(now_ns))
        self._drain()
        for thread in self._threads:
            thread.start()
        self._bus.announce(self._process)
        ticks = [
            _Ticking(slot, slot.node.tick_period_ns, now_ns + slot.node.tick_period_ns)
            for slot in self._slots
            if slot.node.tick_period_ns
        ]
        next_journal_ns, next_latch_ns = now_ns + JOURNAL_PERIOD_NS, now_ns + LATCH_PERIOD_NS
        while not self._stopping.is_set():
            due_ns = min((tick.due_ns for tick in ticks), default=next_journal_ns)
            due_ns = min(due_ns, next_journal_ns)
            if self._held:
                due_ns = min(due_ns, self._held[0][0])
            self._take(due_ns)
            now_ns = time.monotonic_ns()
            self._release(now_ns)
            for tick in ticks:
                if tick.due_ns <= now_ns:
                    told_ns = time.monotonic_ns()  # a node is never told an earlier moment than before
                    self._publish(tick.slot.tick(told_ns))
                    self._drain()
                    tick.advance(told_ns)
            if now_ns >= next_journal_ns:
                self._publish_journal(now_ns)
                next_journal_ns = now_ns + JOURNAL_PERIOD_NS
            if now_ns >= next_latch_ns:
                for envelope, encoded in self._latched.values():
                    self._put(envelope, encoded)
                next_latch_ns = now_ns + LATCH_PERIOD_NS

    # -- in ---------------------------------------------------------------------------------------

    def _subscribe(self) -> None:
        made_here = {
            (topic_of(kind).index, slot.node.vehicle)
            for slot in self._slots
            for kind in slot.node.outputs
            if topic_of(kind).scope is Scope.VEHICLE
        }
        made_here |= {(topic_of(t.port.reads).index, t.port.vehicle) for t in self._threads}
        keys = set()
        for index, vehicle in self._dispatch.topics():
            topic = TOPICS[index]
            if topic.scope is Scope.PROCESS:
                keys.add(f"*/{topic.noun}")
            elif (index, vehicle) not in made_here:
                keys.add(key_of(topic, vehicle))
        for key in sorted(keys):
            self._bus.subscribe(key, self._from_bus)

    def _from_bus(self, key: str, payload: bytes, attachment: bytes) -> None:
        self._inbox.put(key, Remote(key, payload, attachment), topic_named(split_key(key)[1]).delivery)

    def _from_port(self, port: PortTranslation, stamp_ns: int, data: object) -> None:
        self._inbox.put(port.channel, FromPort(port, stamp_ns, data), port.delivery)

    def _take(self, due_ns: int) -> None:
        """Handle what has come in, waiting for it until ``due_ns`` at the longest."""
        taken = self._inbox.take((due_ns - time.monotonic_ns()) * 1e-9)
        if taken is None:
            return
        match taken.item:
            case Remote() as remote:
                self._note_replaced(remote.key, taken.replaced)
                self._remote(remote)
            case FromPort(port, stamp_ns, data):
                self._publish_from_port(port.to_message(stamp_ns, data))
        self._drain()

    def _note_replaced(self, key: str, attachments: list[bytes]) -> None:
        """Journal what newer messages replaced before this process looked at it."""
        now_ns = time.monotonic_ns()
        owner, noun = split_key(key)
        for attachment in attachments:
            topic = topic_named(noun)
            for slot in self._dispatch.topics().get((topic.index, owner), ()):
                slot.drop(Envelope.unpack(topic, owner, attachment), now_ns)

    def _remote(self, item: Remote) -> None:
        owner, noun = split_key(item.key)
        topic = topic_named(noun)
        if owner == self._process:
            return  # a session hears its own puts
        try:
            envelope = Envelope.unpack(topic, owner, item.attachment)
            payload = topic.codec.decode(item.payload)
        except (CodecError, ValueError):
            self.undecodable += 1
            return
        if topic.latched:
            key = f"{item.key} {payload.vehicle}"
            said = (envelope.sequence, envelope.publish_ns)
            if self._seen_latched.get(key) == said:
                return
            self._seen_latched[key] = said
        self._local.append(Delivered(envelope, payload))

    # -- out --------------------------------------------------------------------------------------

    def _publish(self, messages: Iterable[Delivered]) -> None:
        """Put on the bus and before the local nodes, now or when the rig's emulated latency has passed."""
        now_ns = time.monotonic_ns()
        for delivered in messages:
            if delivered.envelope.publish_ns > now_ns:
                self._hold(delivered.envelope.publish_ns, delivered)
            else:
                self._send(delivered)

    def _send(self, delivered: Delivered) -> None:
        envelope, payload = delivered
        topic = envelope.topic
        if topic.recorded is Recorded.ALWAYS or self._publish_images:
            encoded = topic.codec.encode(payload)
            self._put(envelope, encoded)
            if topic.latched:
                self._latched[f"{envelope.vehicle}/{topic.noun}"] = (envelope, encoded)
        writer = self._writers.get((topic.index, payload.vehicle))
        if writer is not None:
            writer.write(payload)
        self._local.append(delivered)

    def _put(self, envelope: Envelope, encoded: bytes) -> None:
        """Hand to the bus; the loop goes on without it, since valves and ports are closed from here."""
        if self._hub_is_gone:
            return
        try:
            self._bus.publish(envelope, encoded)
        except zenoh.ZError as error:
            self._hub_is_gone = True
            sys.stderr.write(f"the hub is gone, ending: {error}\n")
            self.stop()

    def _publish_from_port(self, payload: Message) -> None:
        topic = topic_of(type(payload))
        owner = owner_of(topic, payload, self._process)
        sequence = self._sequences.next(topic, owner)
        now_ns = time.monotonic_ns()
        self._journal.note(Kind.PORT, None, topic.index, owner, sequence, now_ns)
        self._send(Delivered(Envelope(topic, owner, sequence, now_ns), payload))

    def _drain(self) -> None:
        """Deliver until no local node has anything to hear."""
        local = self._local
        while local:
            delivered = local.popleft()
            for slot in self._dispatch.hearers(delivered.envelope.topic, delivered.payload):
                self._turns.offer(slot, delivered, time.monotonic_ns())

    def _hold(self, stamp_ns: int, what: Delivered | NodeSlot) -> None:
        self._held_count += 1
        heapq.heappush(self._held, (stamp_ns, self._held_count, what))

    def _release(self, now_ns: int) -> None:
        while self._held and self._held[0][0] <= now_ns:
            _, _, what = heapq.heappop(self._held)
            if isinstance(what, Delivered):
                self._send(what)
            else:
                self._turns.free(what, now_ns)
            self._drain()

    def _port_trouble(self, channel: str, level: int, summary: str) -> None:
        """Called by port threads: a device opened, went away, or cannot be opened."""
        port = _TroublePort(channel)
        self._inbox.put(channel, FromPort(port, time.monotonic_ns(), (level, summary)), port.delivery)

    def _publish_journal(self, now_ns: int) -> None:
        """An empty journal is said too: it is the process's sign of life."""
        names, entries = self._journal.take()
        topic = topic_of(Journal)
        payload = Journal(now_ns, "", self._process, names, entries)
        envelope = Envelope(topic, self._process, self._sequences.next(topic, self._process), now_ns)
        self._put(envelope, topic.codec.encode(payload))

    def _end(self) -> None:
        for slot in self._slots:
            self._publish(slot.stop(time.monotonic_ns()))
            self._drain()
        for thread in self._threads:
            thread.ask_to_end()
        for thread in self._threads:
            thread.close()
        self._publish_journal(time.monotonic_ns())


class _TroublePort(PortTranslation):
    """Turns what a port thread has to say about its device into a ``Diagnostics`` message."""

    reads = Diagnostics

    def __init__(self, channel: str) -> None:
        super().__init__(channel, channel.rpartition("/")[0], None, "")

    def to_message(self, stamp_ns: int, data: object) -> Message:
        assert isinstance(data, tuple)
        level, summary = data
        return Diagnostics(stamp_ns, self.vehicle, self.channel, level, summary, (), ())
