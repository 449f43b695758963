"""What a process keeps of the others' messages: one that is killed takes its unsent records along.

Messages that somebody waits for leave a process at once, its record stream up to 50 ms later. Whoever took in
such a message can still record it, so that a recording with a death in it replays like any other.
"""

from collections import deque

from groundstation.bus.envelope import Envelope
from groundstation.bus.record_stream import RecordWriter

WINDOW_NS = 200_000_000
"""Longer than a record stream waits between two batches, with room for a loaded machine."""


class Witness:
    """The messages of other processes of the last moments, as they were received."""

    def __init__(self) -> None:
        self._kept: deque[tuple[Envelope, bytes]] = deque()

    def keep(self, envelope: Envelope, encoded: bytes) -> None:
        """Remember one message, and forget those that were published long before it."""
        kept = self._kept
        kept.append((envelope, encoded))
        oldest_ns = envelope.publish_ns - WINDOW_NS
        while kept[0][0].publish_ns < oldest_ns:
            kept.popleft()

    def testify(self, record: RecordWriter) -> None:
        """Record what is remembered; the recorder leaves out what it already has."""
        for envelope, encoded in self._kept:
            record.add(envelope, encoded)
