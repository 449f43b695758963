"""What the recorder reports of itself: how much it has written, and how long its disk lasts."""

import math
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path

from groundstation.bus.cdr import codec_of
from groundstation.bus.envelope import Envelope
from groundstation.bus.record_stream import RecordWriter
from groundstation.bus.zenoh_bus import ZenohBus
from groundstation.parts.operation.messages import RecorderStatus
from groundstation.recording.disk_file import free_bytes
from groundstation.recording.writer import Recorder

PERIOD_NS = 500_000_000
RATE_WINDOW_NS = 10_000_000_000


class RecorderReporter:
    """Publishes ``RecorderStatus`` at once and then twice a second, on its own key and to be recorded.

    Args:
        recorder: Whose file it is.
        bus: Session with the hub.
        process: Name of the process.
        sequences_after: Numbers begin after this one.
        free: Tells the free bytes on the disk of a file.
    """

    def __init__(
        self,
        recorder: Recorder,
        bus: ZenohBus,
        process: str,
        sequences_after: int = 0,
        free: Callable[[Path], int] = free_bytes,
    ) -> None:
        self._recorder = recorder
        self._bus = bus
        self._process = process
        self._sequence = sequences_after
        self._free = free
        self._due_ns = 0
        self._is_stalled = False
        self._written: deque[tuple[int, int]] = deque()

    def stall(self) -> None:
        """Report from now on that there is no room at all."""
        self._is_stalled = True
        self._due_ns = 0

    def go_on(self, recorder: Recorder) -> None:
        """Report of another file."""
        self._recorder = recorder
        self._is_stalled = False
        self._written.clear()
        self._due_ns = 0

    def look(self, now_ns: int) -> RecorderStatus | None:
        """Publish if it is due; what was published."""
        if now_ns < self._due_ns:
            return None
        self._due_ns = now_ns + PERIOD_NS
        status = self._status(now_ns)
        self._sequence += 1
        envelope = Envelope(RecorderStatus.TOPIC, "", self._sequence, time.monotonic_ns())
        encoded = codec_of(RecorderStatus).encode(status)
        self._bus.put(RecorderStatus.TOPIC, "", encoded, envelope.attachment())
        batch = RecordWriter()
        batch.add(envelope, encoded)
        self._bus.publish_batch(self._process, batch.take())
        return status

    def _status(self, now_ns: int) -> RecorderStatus:
        written, free = self._recorder.written_bytes, self._free(self._recorder.part_path)
        self._written.append((now_ns, written))
        while now_ns - self._written[0][0] > RATE_WINDOW_NS:
            self._written.popleft()
        first_ns, first = self._written[0]
        room_s = 0.0 if self._is_stalled else math.inf
        if written > first and not self._is_stalled:
            left = max(0, free - self._recorder.rest_bytes)
            room_s = left * (now_ns - first_ns) * 1e-9 / (written - first)
        return RecorderStatus(now_ns, "", str(self._recorder.part_path), written, free, room_s)
