"""The live runner: one process, one loop, one queue; wall clock and Zenoh.

Threads only read devices or the bus and append to the queue; nodes run in the loop. Messages inside a process
are delivered directly. On its own key a topic goes out at once, for the processes that subscribe to it; all
that is published goes out once more in the record stream. What comes apart (a stop) has a session of its own
and is taken before everything that waits; what ports keep (a memory) is delivered before anything else.
"""

import heapq
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from groundstation.bus.envelope import Delivered
from groundstation.bus.journal import JournalWriter
from groundstation.bus.listener import Decoder, Remote
from groundstation.bus.zenoh_bus import ZenohBus, key_of, split_key
from groundstation.declarations.message import Message
from groundstation.declarations.port import Edge, Port
from groundstation.declarations.topic import Delivery, Scope
from groundstation.parts.operation.messages import Diagnostics
from groundstation.recording.policy import ImagePolicy
from groundstation.runners.live_inbox import FromPort, Gone, Inbox
from groundstation.runners.live_outlets import LiveOutlets
from groundstation.runners.live_ports import PortThread
from groundstation.runners.slot import Sequences, Slot
from groundstation.runners.step import JOURNAL_PERIOD_NS, Step

LATCH_PERIOD_NS = 1_000_000_000


@dataclass(slots=True)
class _Ticking:
    """When a node is to be ticked next."""

    slot: Slot
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
        slots: Its nodes, in the order of the tables.
        ports: Its edges with their addresses resolved.
        bus: Session with the hub.
        payloads: Payload classes by noun.
        journal: Shared with the slots.
        sequences: Shared with the slots.
        images: What of the cameras is recorded.
        is_done: Asked after ticks; True ends the process.
        apart: A session of its own for topics that come apart; None where none is received or published.
    """

    def __init__(
        self,
        process: str,
        slots: list[Slot],
        ports: Iterable[Port],
        bus: ZenohBus,
        payloads: Mapping[str, type[Message]],
        journal: JournalWriter,
        sequences: Sequences,
        *,
        images: ImagePolicy,
        is_done: Callable[[], bool] = lambda: False,
        apart: ZenohBus | None = None,
    ) -> None:
        self._process = process
        self._bus = bus
        self._apart = apart
        self._payloads = payloads
        self._is_done = is_done
        self._decoder = Decoder(payloads)
        self._inbox = Inbox()
        self._stopping = threading.Event()
        self._out = LiveOutlets(bus, process, images, self.stop, apart)
        self._local: deque[Delivered] = deque()
        self._held: list[tuple[int, int, Delivered | Slot]] = []
        self._held_count = 0
        self._threads = {
            port.channel: PortThread(port, self._from_port, self._port_trouble, self._inbox.fail)
            for port in ports
        }
        own = [thread.port for thread in self._threads.values()]
        self._step = Step(process, slots, own, journal, sequences, self)

    def stop(self) -> None:
        """Ask the loop to end; safe in a signal handler and from any thread."""
        self._stopping.set()
        self._inbox.wake()

    def run(self) -> None:
        """Run until ``stop``; nodes then give their last messages and ports are closed, whatever happened."""
        try:
            self._run()
        finally:
            self._end()

    def _run(self) -> None:
        now_ns = time.monotonic_ns()
        self._step.start(now_ns)
        self._remember()
        self._subscribe()
        for thread in self._threads.values():
            thread.start()
        self._bus.announce(self._process)
        ticks = [
            _Ticking(slot, slot.node.tick_period_ns, now_ns + slot.node.tick_period_ns)
            for slot in self._step.slots
            if slot.node.tick_period_ns
        ]
        next_journal_ns, next_latch_ns = now_ns, now_ns + LATCH_PERIOD_NS
        while not self._stopping.is_set():
            due_ns = min((tick.due_ns for tick in ticks), default=next_journal_ns)
            due_ns = min(due_ns, next_journal_ns)
            if self._out.due_ns is not None:
                due_ns = min(due_ns, self._out.due_ns)
            if self._held:
                due_ns = min(due_ns, self._held[0][0])
            self._take(due_ns)
            now_ns = time.monotonic_ns()
            self._release(now_ns)
            for tick in ticks:
                if tick.due_ns <= now_ns:
                    given_ns = time.monotonic_ns()  # a node is never told an earlier moment than before
                    self._step.tick(tick.slot, given_ns)
                    self._drain()
                    tick.advance(given_ns)
                    if self._is_done():
                        self.stop()
            if now_ns >= next_journal_ns:
                self._out.send(self._step.take_journal(now_ns))
                next_journal_ns = now_ns + JOURNAL_PERIOD_NS
            if now_ns >= next_latch_ns:
                self._out.repeat_latched()
                next_latch_ns = now_ns + LATCH_PERIOD_NS
            self._out.flush(now_ns)

    # -- in ---------------------------------------------------------------------------------------

    def _remember(self) -> None:
        """Deliver what was kept, so that nodes know it before anything else reaches them or leaves a port."""
        self._drain()  # of their start, before what they publish then can replace what was kept
        for thread in self._threads.values():
            if thread.port.is_first:
                for stamp_ns, data in thread.read_first():
                    self._step.arrive(thread.port, stamp_ns, data, time.monotonic_ns())
        self._drain()

    def _subscribe(self) -> None:
        made_here = {
            (kind.TOPIC.noun, slot.node.vehicle)
            for slot in self._step.slots
            for kind in slot.node.outputs
            if kind.TOPIC.scope is Scope.VEHICLE
        }
        ports = (thread.port for thread in self._threads.values())
        made_here |= {(port.reads.TOPIC.noun, port.vehicle) for port in ports}
        keys, apart = set(), set()
        for noun, vehicle in self._step.received:
            topic = self._payloads[noun].TOPIC
            if topic.is_apart and self._apart is not None:
                apart.add(f"*/{noun}" if topic.scope is Scope.PROCESS else key_of(topic, vehicle))
            elif topic.scope is Scope.PROCESS:
                keys.add(f"*/{noun}")
            elif (noun, vehicle) not in made_here:
                keys.add(key_of(topic, vehicle, paced=self._step.is_paced((noun, vehicle))))
        if self._apart is not None:
            for key in sorted(apart):
                self._apart.subscribe(key, self._from_apart)
        for key in sorted(keys):
            self._bus.subscribe(key, self._from_bus)
        self._bus.watch(self._from_watch)

    def _from_bus(self, key: str, payload: bytes, attachment: bytes) -> None:
        kind = self._payloads.get(split_key(key)[1])
        delivery = Delivery.EVERY if kind is None else kind.TOPIC.delivery
        self._inbox.put(key, Remote(key, payload, attachment), delivery)

    def _from_apart(self, key: str, payload: bytes, attachment: bytes) -> None:
        self._inbox.put_urgent(Remote(key, payload, attachment))

    def _from_watch(self, process: str, is_alive: bool) -> None:
        if not is_alive and process != self._process:
            self._inbox.put_gone(process)

    def _from_port(self, port: Port, stamp_ns: int, data: object) -> None:
        self._inbox.put(port.channel, FromPort(port, stamp_ns, data), port.delivery)

    def _take(self, due_ns: int) -> None:
        """Handle what has come in, waiting for it until ``due_ns`` at the longest."""
        taken = self._inbox.take((due_ns - time.monotonic_ns()) * 1e-9)
        if taken is None:
            return
        match taken.item:
            case Remote() as remote:
                self._note_replaced(remote.key, taken.replaced)
                delivered = self._decoder.decode(remote)
                if delivered is not None and delivered.envelope.owner != self._process:
                    self._out.witness(delivered.envelope, remote.payload)
                    self._step.receive(delivered, time.monotonic_ns())
            case FromPort(port, stamp_ns, data):
                self._step.arrive(port, stamp_ns, data, time.monotonic_ns())
            case Gone():
                self._out.testify()
        self._drain()

    def _note_replaced(self, key: str, attachments: list[bytes]) -> None:
        """Journal what newer messages replaced before this process looked at it."""
        now_ns = time.monotonic_ns()
        owner, noun = split_key(key)
        for attachment in attachments:
            envelope = self._decoder.envelope(Remote(key, b"", attachment))
            for slot in self._step.received.get((noun, owner), ()):
                if envelope is not None:
                    slot.drop(envelope, now_ns)

    # -- what the step asks for -------------------------------------------------------------------

    def publish(self, delivered: Delivered) -> None:
        """Send now, or when the rig's emulated latency has passed; see ``Transport``."""
        if delivered.envelope.publish_ns > time.monotonic_ns():
            self._hold(delivered.envelope.publish_ns, delivered)
        else:
            self._send_and_keep(delivered)

    def call_back(self, stamp_ns: int, slot: Slot) -> None:
        """See ``Transport``."""
        self._hold(stamp_ns, slot)

    def write(self, port: Port, payload: Message, now_ns: int) -> None:
        """See ``Transport``."""
        del now_ns
        self._threads[port.channel].write(payload)

    def _send_and_keep(self, delivered: Delivered) -> None:
        port = self._step.writer_of(delivered.payload)
        if port is not None and port.is_first:  # kept before anybody can know of it; delivered later
            self._threads[port.channel].write(delivered.payload)
        self._out.send(delivered)
        self._local.append(delivered)

    def _drain(self) -> None:
        """Deliver until no local node has anything to receive."""
        local = self._local
        while local:
            self._step.deliver(local.popleft(), time.monotonic_ns())

    def _hold(self, stamp_ns: int, what: Delivered | Slot) -> None:
        self._held_count += 1
        heapq.heappush(self._held, (stamp_ns, self._held_count, what))

    def _release(self, now_ns: int) -> None:
        while self._held and self._held[0][0] <= now_ns:
            _, _, what = heapq.heappop(self._held)
            if isinstance(what, Delivered):
                self._send_and_keep(what)
            else:
                self._step.free(what, now_ns)
            self._drain()

    def _port_trouble(self, channel: str, level: int, summary: str) -> None:
        """Called by port threads: a device opened, went away, or cannot be opened."""
        port = _TroublePort(channel, channel.rpartition("/")[0], None)
        self._inbox.put(channel, FromPort(port, time.monotonic_ns(), (level, summary)), port.delivery)

    def _end(self) -> None:
        for slot in self._step.slots:
            self._step.stop(slot, time.monotonic_ns())
            self._drain()
        while self._held:  # emulated latency does not outlive the process
            _, _, what = heapq.heappop(self._held)
            if isinstance(what, Delivered):
                self._send_and_keep(what)
                self._drain()
        for thread in self._threads.values():
            thread.ask_to_end()
        for thread in self._threads.values():
            thread.close()
        now_ns = time.monotonic_ns()
        self._out.send(self._step.take_journal(now_ns))
        self._out.close(now_ns)
        self._step.raise_what_stopping_raised()


@dataclass(frozen=True)
class _TroublePort(Port):
    """Turns what a port thread reports of its device into a ``Diagnostics`` message."""

    reads = Diagnostics

    def to_message(self, stamp_ns: int, data: object) -> Message:
        assert isinstance(data, tuple)
        level, summary = data
        return Diagnostics(stamp_ns, self.vehicle, self.channel, level, summary, (), ())

    def open(self) -> Edge:
        raise TypeError(f"{self.channel} reports trouble and is opened by nobody")
