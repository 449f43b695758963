"""The recorder's process: takes the record stream of every process and writes it to one file."""

import os
import queue
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from groundstation.bus.record_stream import BatchError, RecordWriter, read_batch
from groundstation.bus.zenoh_bus import RECORD, ZenohBus
from groundstation.declarations.errors import GroundStationError, UsageError
from groundstation.declarations.message import Message
from groundstation.launch.orders import Orders
from groundstation.launch.process import NICENESS, obey, stop_when_asked
from groundstation.launch.recorder_reporter import RecorderReporter
from groundstation.parts.operation.messages import RecorderStatus
from groundstation.recording.errors import RecordingError
from groundstation.recording.info import RecordingInfo
from groundstation.recording.writer import Recorder
from groundstation.rig.provenance import recording_info
from groundstation.rig.read import parse_rig

TICK_S = 0.05
ALIVE_PERIOD_NS = 1_000_000_000
SPARE_BYTES = 1 << 20
"""Kept free on the disk beside what is left to write: half a second of two mock-ups and of others."""


def main(orders: Orders) -> None:
    """Record; what the fork server calls."""
    obey(run, orders)


def run(orders: Orders) -> None:
    """Record until asked to stop; what is still in the queue then is written too.

    A disk that is full ends the recording, not the process: nobody starts it again in vain, and the flight
    is told by the silence of ``RecorderStatus``.

    Raises:
        UsageError: The file cannot be begun.
        GroundStationError: It could not be written to the end: the disk is full, or gone.
    """
    assert orders.recording is not None
    os.nice(NICENESS)
    rig = parse_rig(orders.rig_text, orders.rig_path, orders.files)
    info = recording_info(rig, orders.rig_text, orders.rig_path, None, orders.utc_offset_ns)
    batches: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
    stop_when_asked(lambda: batches.put(None))
    recorder = _begin(orders.recording, info)
    with ZenohBus(orders.endpoint) as bus:
        reporter = RecorderReporter(recorder, bus, orders.process, orders.sequences_after)
        bus.subscribe(f"{RECORD}/*", lambda _key, batch, _attachment: batches.put(batch))
        reporter.look(time.monotonic_ns())
        bus.announce(orders.process)
        try:
            with in_a_sentence(recorder):
                write_until_end(recorder, batches, bus, orders.process, rig.tables.payloads, reporter)
                recorder.finish()
        except GroundStationError as error:
            trouble = f"{error} {_end_early(recorder, is_whole=isinstance(error.__cause__, _NoRoomError))}"
            sys.stderr.write(trouble + "\n")
            sys.stderr.flush()
            live_on(batches, bus, orders.process)
            raise GroundStationError(trouble) from error


class _NoRoomError(RecordingError):
    """The disk is nearly full; what was written so far is whole."""


def _end_early(recorder: Recorder, *, is_whole: bool) -> str:
    """Finish a file that cannot be written any further if that is possible; what is there, in words."""
    if is_whole:
        with suppress(RecordingError):
            return f"{recorder.finish()} is complete up to here"
    return f"groundstation recording recover brings back what {recorder.part_path} holds"


def live_on(batches: "queue.SimpleQueue[bytes | None]", bus: ZenohBus, process: str) -> None:
    """Take what comes and forget it until the queue holds None; the others go on."""
    sign_due_ns = 0
    while True:
        now_ns = time.monotonic_ns()
        if now_ns >= sign_due_ns:
            sign_due_ns = now_ns + ALIVE_PERIOD_NS
            bus.publish_batch(process, RecordWriter().take())
        try:
            if batches.get(timeout=ALIVE_PERIOD_NS * 1e-9) is None:
                return
        except queue.Empty:
            continue


@contextmanager
def in_a_sentence(recorder: Recorder) -> Iterator[None]:
    """Name what keeps a recording from being written any further.

    Raises:
        GroundStationError: The disk is full, or gone.
    """
    try:
        yield
    except RecordingError as error:
        raise GroundStationError(f"{error} (after {recorder.message_count} messages).") from error


def _begin(path: Path, info: RecordingInfo) -> Recorder:
    try:
        return Recorder(path, info)
    except RecordingError as error:
        raise UsageError(str(error)) from error


def write_until_end(
    recorder: Recorder,
    batches: "queue.SimpleQueue[bytes | None]",
    bus: ZenohBus,
    process: str,
    payloads: Mapping[str, type[Message]],
    reporter: RecorderReporter | None = None,
) -> None:
    """Write until the queue holds None.

    Raises:
        OSError: The disk is full, or gone; with a reporter while there is still room to finish the file.
    """
    sign_due_ns = 0
    while True:
        now_ns = time.monotonic_ns()
        if now_ns >= sign_due_ns:  # an empty batch is its sign of life
            sign_due_ns = now_ns + ALIVE_PERIOD_NS
            bus.publish_batch(process, RecordWriter().take())
        if reporter is not None:
            _check_room(recorder, reporter.look(now_ns))
        try:
            batch = batches.get(timeout=TICK_S)
        except queue.Empty:
            recorder.tick(time.monotonic_ns())
            continue
        if batch is None:
            return
        try:
            entries = read_batch(batch)
        except BatchError as error:
            sys.stderr.write(f"not recorded: {error}\n")
            continue
        unknown = recorder.record_batch(entries, payloads)
        if unknown:
            sys.stderr.write(f"not recorded: {unknown} messages of topics that no part declares\n")


def _check_room(recorder: Recorder, status: RecorderStatus | None) -> None:
    """End in time: the index that makes it a finished recording needs room, too."""
    if status is not None and status.free_bytes < recorder.rest_bytes + SPARE_BYTES:
        raise _NoRoomError(f"{recorder.part_path} cannot be written any further: the disk is full")
