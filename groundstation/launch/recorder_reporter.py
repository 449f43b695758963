"""What the recorder reports of itself: how much it has written, how long its disk lasts, what was lost."""

import math
import time
from collections import deque
from collections.abc import Callable
from operator import attrgetter

from groundstation.bus.cdr import codec_of
from groundstation.bus.envelope import Envelope
from groundstation.bus.record_stream import RecordWriter
from groundstation.bus.zenoh_bus import ZenohBus
from groundstation.declarations.message import Message
from groundstation.declarations.names import RECORDER
from groundstation.parts.operation.messages import Diagnostics, RecorderStatus
from groundstation.recording.errors import RecordingError
from groundstation.recording.writer import Recorder

PERIOD_NS = 500_000_000
RATE_WINDOW_NS = 10_000_000_000
HEALTH_PERIOD_NS = 1_000_000_000
TOLD_NS = 10_000_000_000
"""So long it is told that something was lost, after recording has gone on."""


class RecorderReporter:
    """Publishes ``RecorderStatus`` at once and then twice a second, and once a second ``Diagnostics``.

    Both go out on their own keys and to be recorded. The diagnostics name what is wrong with the recording,
    at once when it goes wrong.

    Args:
        recorder: Whose file it is.
        bus: Session with the hub.
        process: Name of the process.
        sequences_after: Numbers begin after this one.
        free: Tells the free bytes on the disk of its file.
    """

    def __init__(
        self,
        recorder: Recorder,
        bus: ZenohBus,
        process: str,
        sequences_after: int = 0,
        free: Callable[[Recorder], int] = attrgetter("free_bytes"),
    ) -> None:
        self._recorder = recorder
        self._bus = bus
        self._process = process
        self._sequences = dict.fromkeys((RecorderStatus, Diagnostics), sequences_after)
        self._free = free
        self._due_ns = 0
        self._health_due_ns = 0
        self._trouble = ""
        self._told_until_ns: int | None = None
        self._is_stalled = self._is_full = False
        self._written: deque[tuple[int, int]] = deque()

    def stall(self, trouble: str = "", *, is_full: bool = True) -> None:
        """Report from now on that nothing is recorded.

        Args:
            trouble: Why.
            is_full: There is no room at all.
        """
        self._is_stalled, self._is_full, self._trouble = True, is_full, trouble
        self._told_until_ns = None
        self._due_ns = self._health_due_ns = 0

    def go_on(self, recorder: Recorder) -> None:
        """Report of another file."""
        if self._is_stalled:
            told_ns = 0 if self._is_full else TOLD_NS  # of a disk that has room again nothing more is told
            self._told_until_ns = time.monotonic_ns() + told_ns
        self._recorder = recorder
        self._is_stalled = self._is_full = False
        self._written.clear()
        self._due_ns = self._health_due_ns = 0

    def look(self, now_ns: int) -> RecorderStatus | None:
        """Publish if it is due; the status that was published.

        Raises:
            RecordingError: The disk of the file that is written is gone.
        """
        if now_ns < self._due_ns:
            return None
        self._due_ns = now_ns + PERIOD_NS
        status = self._status(now_ns)
        self._publish(status, "")
        if now_ns >= self._health_due_ns:
            self._health_due_ns = now_ns + HEALTH_PERIOD_NS
            self._publish(self._health(now_ns), self._process)
        return status

    def _publish(self, message: Message, owner: str) -> None:
        kind = type(message)
        self._sequences[kind] += 1
        envelope = Envelope(kind.TOPIC, owner, self._sequences[kind], time.monotonic_ns())
        encoded = codec_of(kind).encode(message)
        self._bus.put(kind.TOPIC, owner, encoded, envelope.attachment())
        batch = RecordWriter()
        batch.add(envelope, encoded)
        self._bus.publish_batch(self._process, batch.take())

    def _health(self, now_ns: int) -> Diagnostics:
        if self._told_until_ns is not None and now_ns >= self._told_until_ns:
            self._trouble, self._told_until_ns = "", None
        level = int(bool(self._trouble)) + self._is_stalled
        count = str(self._recorder.message_count)
        return Diagnostics(now_ns, "", RECORDER, level, self._trouble, ("messages",), (count,))

    def _free_bytes(self) -> int:
        try:
            return self._free(self._recorder)
        except RecordingError:
            if self._is_stalled:  # that is known
                return 0
            raise

    def _status(self, now_ns: int) -> RecorderStatus:
        written, free = self._recorder.written_bytes, self._free_bytes()
        self._written.append((now_ns, written))
        while now_ns - self._written[0][0] > RATE_WINDOW_NS:
            self._written.popleft()
        first_ns, first = self._written[0]
        room_s = 0.0 if self._is_full else math.inf
        if written > first and not self._is_stalled:
            left = max(0, free - self._recorder.rest_bytes)
            room_s = left * (now_ns - first_ns) * 1e-9 / (written - first)
        return RecorderStatus(now_ns, "", str(self._recorder.part_path), written, free, room_s)
