"""A recorder whose disk is full: it lives on, and goes on in another file when there is room."""

import queue
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from groundstation.bus.record_stream import RecordWriter
from groundstation.bus.zenoh_bus import ZenohBus
from groundstation.launch.recorder_reporter import RecorderReporter
from groundstation.recording.disk_file import free_bytes
from groundstation.recording.errors import RecordingError
from groundstation.recording.run_files import next_name
from groundstation.recording.writer import Recorder

ALIVE_PERIOD_NS = 1_000_000_000
SPARE_BYTES = 1 << 20
"""Kept free on the disk beside what is left to write: half a second of two mock-ups and of others."""
ROOM_AGAIN_BYTES = 3 * SPARE_BYTES
"""Free on the disk before another file is begun."""
RETRY_NS = 1_000_000_000
TICK_S = 0.2


class Pause:
    """From a disk that is full to one that has room.

    Args:
        recorder: Of the file that cannot be written any further; it is finished as soon as that is possible.
        first: First file of the run: the names of others are made from it.
        begin: Begins a recording of this name.
        free: Tells the free bytes on the disk of a file.
    """

    def __init__(
        self,
        recorder: Recorder,
        first: Path,
        begin: Callable[[Path], Recorder],
        free: Callable[[Path], int] = free_bytes,
    ) -> None:
        self._recorder = recorder
        self._first = first
        self._begin = begin
        self._free = free
        self._is_finished = False
        self._try_to_finish()

    def words(self) -> str:
        """What is there."""
        if self._is_finished and not self._recorder.message_count:
            return f"{self._recorder.path} is not begun"
        if self._is_finished:
            return f"{self._recorder.path} is complete up to here"
        return f"groundstation recording recover brings back what {self._recorder.part_path} holds"

    def wait(
        self,
        batches: "queue.SimpleQueue[bytes | None]",
        bus: ZenohBus,
        process: str,
        reporter: RecorderReporter,
    ) -> Recorder | None:
        """Take what comes and forget it; the next file once there is room, None when asked to end."""
        sign_due_ns = 0
        retry_due_ns = time.monotonic_ns() + RETRY_NS
        while True:
            now_ns = time.monotonic_ns()
            if now_ns >= sign_due_ns:
                sign_due_ns = now_ns + ALIVE_PERIOD_NS
                bus.publish_batch(process, RecordWriter().take())
            with suppress(RecordingError):  # the folder is gone
                reporter.look(now_ns)
            if now_ns >= retry_due_ns:
                retry_due_ns = now_ns + RETRY_NS
                found = self.try_to_go_on()
                if found is not None:
                    return found
            try:
                if batches.get(timeout=TICK_S) is None:
                    self._try_to_finish()
                    return None
            except queue.Empty:
                continue

    def try_to_go_on(self) -> Recorder | None:
        """The next file, if there is room for it."""
        self._try_to_finish()
        try:
            if self._free(self._first) < ROOM_AGAIN_BYTES:
                return None
            return self._begin(next_name(self._first))
        except RecordingError:
            return None  # it was said why

    def _try_to_finish(self) -> None:
        if not self._is_finished:
            with suppress(RecordingError):
                self._recorder.end_early()
                self._is_finished = True
