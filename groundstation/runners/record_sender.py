"""Sends a process's record stream from a thread of its own: a slow recorder never delays the flight."""

import queue
import sys
import threading

import zenoh

from groundstation.bus.record_stream import RecordWriter
from groundstation.bus.zenoh_bus import ZenohBus

MOST_BYTES = 64 << 20
"""What may wait in memory for a recorder that has stopped; batches beyond that are dropped and reported."""
_CLOSE_S = 1.0


class RecordSender:
    """Takes batches and puts them on the bus in order.

    Args:
        bus: Session with the hub.
        process: Whose stream it is.

    Attributes:
        dropped: Batches that were given up since too many waited.
        is_broken: The hub is gone.
    """

    def __init__(self, bus: ZenohBus, process: str) -> None:
        self._bus = bus
        self._process = process
        self._queue: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
        self._waiting_bytes = 0
        self._lock = threading.Lock()
        self.dropped = 0
        self.is_broken = False
        self._thread = threading.Thread(target=self._run, name="record stream", daemon=True)
        self._thread.start()

    def send(self, writer: RecordWriter) -> None:
        """Queue what a writer has collected."""
        batch = writer.take()
        with self._lock:
            if self._waiting_bytes + len(batch) > MOST_BYTES:
                self.dropped += 1
                if self.dropped == 1:
                    sys.stderr.write(f"not recorded: batches, since more than {MOST_BYTES >> 20} MiB wait\n")
                return
            self._waiting_bytes += len(batch)
        self._queue.put(batch)

    def close(self) -> None:
        """Send what waits, then end; report how many batches were dropped."""
        if self.dropped:
            sys.stderr.write(f"not recorded: {self.dropped} batches in all\n")
        self._queue.put(None)
        self._thread.join(_CLOSE_S)

    def _run(self) -> None:
        while (batch := self._queue.get()) is not None:
            try:
                self._bus.publish_batch(self._process, batch)
            except zenoh.ZError:
                self.is_broken = True
            with self._lock:
                self._waiting_bytes -= len(batch)
