"""The lockstep runner: virtual time, a heap of events, deterministic by seed, as fast as the CPU allows.

Order of events: by stamp; at equal stamps messages by (rank of the topic, order of publication), then ticks.
Nodes take no time unless the rig says so (``busy_s``, ``late_s``). The laboratory is advanced to the stamp of
whatever comes next, and what it hands over becomes messages through the ports.
"""

import heapq
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Protocol

from drivers.laboratory import Laboratory
from groundstation.bus.envelope import Delivered
from groundstation.bus.journal import JournalWriter
from groundstation.declarations.message import Message
from groundstation.declarations.port import Port
from groundstation.runners.interrupts import InterruptBetweenSteps
from groundstation.runners.slot import Sequences, Slot
from groundstation.runners.step import JOURNAL_PERIOD_NS, Step

PROCESS = "lockstep"
_TICK_RANK = 1 << 20  # after every topic


@dataclass(frozen=True, slots=True)
class _Free:
    """A busy node is free again."""

    slot: Slot


_Event = Delivered | Slot | _Free | None
"""A message to deliver, a node to tick, a node that is free, or the journal to publish."""


class Observer(Protocol):
    """Sees every published message in order, e.g. the recorder or the report."""

    def __call__(self, delivered: Delivered, now_ns: int) -> None:
        """Take one message; ``now_ns`` is the virtual moment of its publication."""


class LockstepRunner:
    """Runs nodes against a laboratory in virtual time.

    Args:
        slots: Nodes in the order of the tables.
        laboratory: Anything that implements ``Laboratory``.
        ports: The laboratory's channels.
        observers: Called for each published message.
        journal: Shared with the slots.
        sequences: Shared with the slots.
    """

    def __init__(
        self,
        slots: list[Slot],
        laboratory: Laboratory,
        ports: Iterable[Port],
        observers: Iterable[Observer],
        journal: JournalWriter,
        sequences: Sequences,
    ) -> None:
        self._laboratory = laboratory
        self._ports = {port.channel: port for port in ports}
        self._step = Step(PROCESS, slots, self._ports.values(), journal, sequences, self)
        self._observers = tuple(observers)
        self._journal = journal
        self._heap: list[tuple[int, int, int, _Event]] = []
        self._count = 0
        self._arrival_ns: int | None = None
        self._arrival_known = False
        self._is_running = False
        self.now_ns = 0

    def run(self, duration_ns: int, progress: Callable[[int], None] | None = None) -> None:
        """Run for ``duration_ns`` of virtual time; may be called again to go on.

        Raises:
            KeyboardInterrupt: Ctrl-C came; the step in which it came is over.
        """
        with InterruptBetweenSteps() as interrupt:
            self._run(duration_ns, progress, interrupt)

    def _run(
        self, duration_ns: int, progress: Callable[[int], None] | None, interrupt: InterruptBetweenSteps
    ) -> None:
        until_ns = self.now_ns + duration_ns
        if not self._is_running:
            self._begin()
        report_ns = 0
        laboratory, heap, observers, deliver = (
            self._laboratory,
            self._heap,
            self._observers,
            self._step.deliver,
        )
        while not interrupt.is_due:
            next_ns = heap[0][0] if heap else until_ns
            if not self._arrival_known:
                self._arrival_ns, self._arrival_known = laboratory.next_arrival_ns(), True
            arrival_ns = self._arrival_ns
            if arrival_ns is not None and arrival_ns <= next_ns and arrival_ns <= until_ns:
                self._arrive(arrival_ns)
                continue
            if next_ns > until_ns or not heap:
                break
            stamp_ns, _, _, what = heapq.heappop(heap)
            self.now_ns = stamp_ns
            if isinstance(what, Delivered):
                for observe in observers:
                    observe(what, stamp_ns)
                deliver(what, stamp_ns)
            elif what is None:
                self._publish_journal(stamp_ns)
                self._push(stamp_ns + JOURNAL_PERIOD_NS, _TICK_RANK + 1, None)
            elif isinstance(what, _Free):
                self._step.free(what.slot, stamp_ns)
            else:
                self._step.tick(what, stamp_ns)
                self._push(stamp_ns + what.node.tick_period_ns, _TICK_RANK, what)
            if progress is not None and stamp_ns >= report_ns:
                progress(stamp_ns)
                report_ns = stamp_ns + 250_000_000
        if interrupt.is_due:
            return
        self._arrive(until_ns)
        self.now_ns = until_ns
        self._publish_journal(until_ns)

    def close(self) -> None:
        """End in good order: nodes give their last messages, then the laboratory is released.

        Raises:
            NodeError: A node raised something; the others have stopped.
        """
        try:
            self._stop_nodes()
        finally:
            self._laboratory.close()

    def _stop_nodes(self) -> None:
        if not self._is_running:
            return
        self._is_running = False
        for slot in self._step.slots:
            self._step.stop(slot, self.now_ns)
        while self._heap and self._heap[0][0] <= self.now_ns:
            _, _, _, what = heapq.heappop(self._heap)
            if isinstance(what, Delivered):
                for observe in self._observers:
                    observe(what, self.now_ns)
                self._step.deliver(what, self.now_ns)
        self._publish_journal(self.now_ns)
        self._step.raise_what_stopping_raised()

    # -- what the step asks for -------------------------------------------------------------------

    def publish(self, delivered: Delivered) -> None:
        """See ``Transport``."""
        topic, _, _, publish_ns = delivered[0][:4]
        self._count += 1
        heapq.heappush(self._heap, (publish_ns, topic.rank, self._count, delivered))

    def call_back(self, stamp_ns: int, slot: Slot) -> None:
        """See ``Transport``."""
        self._push(stamp_ns, _TICK_RANK, _Free(slot))

    def write(self, port: Port, payload: Message, now_ns: int) -> None:
        """See ``Transport``."""
        self._arrival_known = False  # what is sent in may bring something out earlier
        self._laboratory.deliver(now_ns, port.channel, port.to_device(payload))

    # -- events -----------------------------------------------------------------------------------

    def _begin(self) -> None:
        self._is_running = True
        self._step.start(self.now_ns)
        for slot in self._step.slots:
            if slot.node.tick_period_ns:
                self._push(self.now_ns + slot.node.tick_period_ns, _TICK_RANK, slot)
        self._push(self.now_ns + JOURNAL_PERIOD_NS, _TICK_RANK + 1, None)

    def _push(self, stamp_ns: int, rank: int, what: _Event) -> None:
        self._count += 1
        heapq.heappush(self._heap, (stamp_ns, rank, self._count, what))

    def _arrive(self, stamp_ns: int) -> None:
        """Advance the laboratory and take what it hands over."""
        self._arrival_known = False
        arrivals = self._laboratory.advance(stamp_ns)
        self.now_ns = stamp_ns  # who ends the run now ends it here
        for arrival in arrivals:
            port = self._ports.get(arrival.channel)
            if port is not None:
                self._step.arrive(port, arrival.stamp_ns, arrival.data, arrival.stamp_ns)

    def _publish_journal(self, now_ns: int) -> None:
        if len(self._journal):
            delivered = self._step.take_journal(now_ns)
            for observe in self._observers:
                observe(delivered, now_ns)
