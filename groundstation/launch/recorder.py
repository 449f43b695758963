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
from groundstation.recording.errors import RecordingError
from groundstation.recording.info import RecordingInfo
from groundstation.recording.writer import Recorder
from groundstation.rig.provenance import recording_info
from groundstation.rig.read import parse_rig

TICK_S = 0.05
ALIVE_PERIOD_NS = 1_000_000_000


def main(orders: Orders) -> None:
    """Record; what the fork server calls."""
    obey(run, orders)


def run(orders: Orders) -> None:
    """Record until asked to stop; what is still in the queue then is written too.

    Raises:
        UsageError: The file cannot be begun.
        GroundStationError: It cannot be written any further: the disk is full, or gone.
    """
    assert orders.recording is not None
    os.nice(NICENESS)
    rig = parse_rig(orders.rig_text, orders.rig_path, orders.files)
    info = recording_info(rig, orders.rig_text, orders.rig_path, None, orders.utc_offset_ns)
    batches: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
    stop_when_asked(lambda: batches.put(None))
    recorder = _begin(orders.recording, info)
    with in_a_sentence(recorder):
        with ZenohBus(orders.endpoint) as bus:
            bus.subscribe(f"{RECORD}/*", lambda _key, batch, _attachment: batches.put(batch))
            bus.announce(orders.process)
            write_until_end(recorder, batches, bus, orders.process, rig.tables.payloads)
        recorder.finish()


@contextmanager
def in_a_sentence(recorder: Recorder) -> Iterator[None]:
    """Name what keeps a recording from being written any further.

    Raises:
        GroundStationError: The disk is full, or gone.
    """
    try:
        yield
    except RecordingError as error:
        raise GroundStationError(
            f"{error} (after {recorder.message_count} messages; recovery brings back what is there)"
        ) from error


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
) -> None:
    """Write until the queue holds None."""
    sign_due_ns = 0
    while True:
        now_ns = time.monotonic_ns()
        if now_ns >= sign_due_ns:  # an empty batch is its sign of life
            sign_due_ns = now_ns + ALIVE_PERIOD_NS
            bus.publish_batch(process, RecordWriter().take())
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
