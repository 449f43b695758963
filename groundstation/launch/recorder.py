"""The recorder's process: takes the record stream of every process and writes it to one file."""

import os
import queue
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from groundstation.bus.record_stream import BatchError, RecordWriter, read_batch
from groundstation.bus.zenoh_bus import RECORD, ZenohBus
from groundstation.declarations.errors import GroundStationError, UsageError
from groundstation.declarations.message import Message
from groundstation.launch.orders import Orders
from groundstation.launch.process import NICENESS, obey, stop_when_asked
from groundstation.launch.recorder_pause import ALIVE_PERIOD_NS, SPARE_BYTES, Pause, next_name
from groundstation.launch.recorder_reporter import RecorderReporter
from groundstation.recording.errors import RecordingError
from groundstation.recording.info import RecordingInfo
from groundstation.recording.writer import Recorder
from groundstation.rig.provenance import recording_info
from groundstation.rig.read import parse_rig

TICK_S = 0.05


def main(orders: Orders) -> None:
    """Record; what the fork server calls."""
    obey(run, orders)


def run(orders: Orders) -> None:
    """Record until asked to stop; what is still in the queue then is written too.

    A disk that is full ends a file, not the process: the flight is told, and recording goes on in another
    file when there is room again.

    Raises:
        UsageError: The file cannot be begun.
        GroundStationError: Something was not recorded: the disk was full, or gone.
    """
    assert orders.recording is not None
    os.nice(NICENESS)
    rig = parse_rig(orders.rig_text, orders.rig_path, orders.files)
    info = recording_info(rig, orders.rig_text, orders.rig_path, None, orders.utc_offset_ns)
    batches: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
    stop_when_asked(lambda: batches.put(None))
    with ZenohBus(orders.endpoint) as bus:  # first: without a hub no file is begun
        recorder = _begin(next_name(orders.recording) if orders.restarts else orders.recording, info)
        reporter = RecorderReporter(recorder, bus, orders.process, orders.sequences_after)
        bus.subscribe(f"{RECORD}/*", lambda _key, batch, _attachment: batches.put(batch))
        reporter.look(time.monotonic_ns())
        bus.announce(orders.process)
        trouble = ""
        while True:
            is_over = False
            try:
                with in_a_sentence(recorder):
                    write_until_end(recorder, batches, bus, orders.process, rig.tables.payloads, reporter)
                    is_over = True
                    recorder.finish()
                break
            except GroundStationError as error:
                pause, reason = Pause(recorder, orders.recording, info), str(error)
            sys.stderr.write(f"{reason} {pause.words()}\n")
            sys.stderr.flush()
            reporter.stall()
            following = None if is_over else pause.wait(batches, bus, orders.process, reporter)
            trouble = f"{reason} {pause.words()}"  # it may have become whole meanwhile
            if following is None:
                break
            recorder = following
            reporter.go_on(recorder)
            sys.stderr.write(f"recording goes on in {recorder.path}\n")
            sys.stderr.flush()
        if trouble:
            raise GroundStationError(trouble)


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
        return Recorder(path, info, spare_bytes=SPARE_BYTES)
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
        RecordingError: The disk is full, or gone; with a reporter while there is room to finish the file.
    """
    sign_due_ns = 0
    while True:
        now_ns = time.monotonic_ns()
        if now_ns >= sign_due_ns:  # an empty batch is its sign of life
            sign_due_ns = now_ns + ALIVE_PERIOD_NS
            bus.publish_batch(process, RecordWriter().take())
        if reporter is not None:
            status = reporter.look(now_ns)
            if status is not None:
                recorder.check_room(status.free_bytes)
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
