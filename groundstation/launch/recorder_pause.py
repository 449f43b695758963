"""A file that takes no more: what becomes of it, and how recording goes on in another."""

import queue
import time
from collections.abc import Callable
from pathlib import Path

from groundstation.bus.record_stream import RecordWriter
from groundstation.bus.zenoh_bus import ZenohBus
from groundstation.launch.recorder_reporter import RecorderReporter
from groundstation.recording.disk_file import free_bytes
from groundstation.recording.errors import DeletedFileError, RecordingError
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
    """From a file that cannot be written any further to the next one.

    Args:
        recorder: Of that file, which is finished as soon as that is possible.
        first: First file of the run: the names of others are made from it.
        begin: Begins a recording of this name.
        free: Tells the free bytes on the disk where a file would be begun.
        is_full: It is room that was missing: what is still in memory is dropped, and room waited for.
        at_once: The next file is not waited for.
    """

    def __init__(
        self,
        recorder: Recorder,
        first: Path,
        begin: Callable[[Path], Recorder],
        free: Callable[[Path], int] = free_bytes,
        *,
        is_full: bool = True,
        at_once: bool = False,
    ) -> None:
        self._recorder = recorder
        self._first = first
        self._begin = begin
        self._free = free
        self._is_full = is_full
        self._wait_ns = 0 if at_once else RETRY_NS
        self._is_finished = self._is_deleted = False
        self.try_to_finish()

    def words(self) -> str:
        """What became of the file, as it is now."""
        path, part = self._recorder.path, self._recorder.part_path
        if self._is_finished and not self._recorder.message_count:
            return f"{path} is not begun"
        if self._is_deleted:
            return "What it held is lost."
        if self._is_finished:
            is_there = path.is_file()
            return f"{path} is complete up to here" if is_there else f"{path} was complete and is gone since"
        if self._recorder.is_whole and not part.is_file():
            return f"Where that disk is mounted again, {part.name} is complete on it."
        if part.is_file():
            return f"groundstation recording recover brings back what {part} holds"
        return "What it held is lost, unless its disk comes back."

    def wait(
        self,
        batches: "queue.SimpleQueue[bytes | None]",
        bus: ZenohBus,
        process: str,
        reporter: RecorderReporter,
    ) -> Recorder | None:
        """Take what comes and forget it; the next file once there can be one, None when asked to end."""
        sign_due_ns = 0
        retry_due_ns = time.monotonic_ns() + self._wait_ns
        while True:
            now_ns = time.monotonic_ns()
            if now_ns >= sign_due_ns:
                sign_due_ns = now_ns + ALIVE_PERIOD_NS
                bus.publish_batch(process, RecordWriter().take())
            reporter.look(now_ns)
            if now_ns >= retry_due_ns:
                retry_due_ns = now_ns + RETRY_NS
                found = self.try_to_go_on()
                if found is not None:
                    return found
            try:
                if batches.get(timeout=TICK_S) is None:
                    self.try_to_finish()
                    return None
            except queue.Empty:
                continue

    def try_to_go_on(self) -> Recorder | None:
        """The next file, if there is room for it."""
        self.try_to_finish()
        try:
            if self._free(self._first) < ROOM_AGAIN_BYTES:
                return None
            return self._begin(next_name(self._first))
        except RecordingError:
            return None  # it was said why

    def try_to_finish(self) -> None:
        """Finish the file, if it is not and can be."""
        if self._is_finished or self._is_deleted:
            return
        try:
            if self._recorder.message_count and (self._recorder.is_whole or not self._is_full):
                self._recorder.finish()
            else:
                self._recorder.end_early()
        except DeletedFileError:
            self._is_deleted = True
            self._recorder.discard()
        except RecordingError:
            return  # later, perhaps
        else:
            self._is_finished = True
