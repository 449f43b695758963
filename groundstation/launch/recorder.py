"""The recorder's process: takes the record stream of every process and writes it to one file."""

import os
import queue
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import NamedTuple

from groundstation.bus.record_stream import BatchError, RecordWriter, read_batch
from groundstation.bus.zenoh_bus import RECORD, ZenohBus
from groundstation.declarations.errors import GroundStationError, UsageError
from groundstation.declarations.message import Message
from groundstation.launch.orders import Orders
from groundstation.launch.process import NICENESS, obey, stop_when_asked
from groundstation.launch.recorder_pause import ALIVE_PERIOD_NS, RETRY_NS, SPARE_BYTES, Pause
from groundstation.launch.recorder_reporter import RecorderReporter
from groundstation.recording.errors import NoRoomError, RecordingError
from groundstation.recording.info import RecordingInfo
from groundstation.recording.run_files import next_name
from groundstation.recording.writer import Recorder
from groundstation.rig.provenance import recording_info
from groundstation.rig.read import parse_rig

TICK_S = 0.05
FLUSH_PERIOD_NS = 150_000_000
"""With the batches that are still on their way, a recorder that is killed loses 0.3 s at most."""


def main(orders: Orders) -> None:
    """Record; what the fork server calls."""
    obey(run, orders)


def run(orders: Orders) -> None:
    """Record until asked to stop; what is still in the queue then is written too.

    A disk that is full, or a file that is lost, ends a file, not the process: the flight is told, and
    recording goes on in another file when there can be one. A file that is moved is followed. Where the rig
    splits recordings, another file goes on without a gap.

    Raises:
        UsageError: The file cannot be begun.
        GroundStationError: Something was not recorded: the disk was full, or gone.
    """
    assert orders.recording is not None
    os.nice(NICENESS)
    rig = parse_rig(orders.rig_text, orders.rig_path, orders.files)
    info = recording_info(rig, orders.rig_text, orders.rig_path, None, orders.utc_offset_ns)
    begin = partial(begin_file, info, rig.tables.payloads)
    split_ns = None if rig.record.split_s is None else round(rig.record.split_s * 1e9)
    batches: queue.SimpleQueue[bytes | None] = queue.SimpleQueue()
    stop_when_asked(lambda: batches.put(None))
    with ZenohBus(orders.endpoint) as bus:  # first: without a hub no file is begun
        try:
            recorder = begin(next_name(orders.recording) if orders.restarts else orders.recording)
        except RecordingError as error:
            raise UsageError(str(error)) from error
        reporter = RecorderReporter(recorder, bus, orders.process, orders.sequences_after)
        bus.subscribe(f"{RECORD}/*", lambda _key, batch, _attachment: batches.put(batch))
        reporter.look(time.monotonic_ns())
        bus.announce(orders.process)
        pauses: list[_Told] = []
        is_over = False
        while not is_over:
            asked, began_ns = recorder.path, time.monotonic_ns()
            until_ns = None if split_ns is None else began_ns + split_ns
            try:
                with in_a_sentence(recorder):
                    is_over = write_until_end(
                        recorder, batches, bus, orders.process, rig.tables.payloads, reporter, until_ns
                    )
                    following = None if is_over else begin(next_name(orders.recording), recorder)
                    _finish(recorder, following)
            except GroundStationError as error:
                is_full = isinstance(error.__cause__, NoRoomError)
                pause = Pause(
                    recorder,
                    orders.recording,
                    partial(begin, before=recorder),
                    is_full=is_full,
                    at_once=not is_full and time.monotonic_ns() - began_ns >= RETRY_NS,
                )
                sentence = f"{error} {pause.words()}"
                pauses.append(_Told(str(error), pause, sentence))
                _complain(sentence)
                reporter.stall(sentence, is_full=is_full)
                following = None if is_over else pause.wait(batches, bus, orders.process, reporter)
                if following is not None:
                    _complain(f"recording goes on in {following.path}")
            if following is None:
                break
            recorder = following
            reporter.go_on(recorder)
        if recorder.path != asked and recorder.path.is_file():
            _complain(f"{recorder.path} is complete")
        if pauses:
            raise GroundStationError(_what_became(pauses))


class _Told(NamedTuple):
    """A file that took no more: why, what became of it, and what was said of that."""

    reason: str
    pause: Pause
    sentence: str


def _what_became(pauses: list[_Told]) -> str:
    """What became of the last file that took no more; where it has changed, earlier ones are named again."""
    for told in pauses:
        told.pause.try_to_finish()
    *earlier, last = [told._replace(sentence=f"{told.reason} {told.pause.words()}") for told in pauses]
    for told, before in zip(earlier, pauses, strict=False):
        if told.sentence != before.sentence:
            _complain(told.sentence)
    return last.sentence


def begin_file(
    info: RecordingInfo,
    payloads: Mapping[str, type[Message]],
    path: Path,
    before: Recorder | None = None,
) -> Recorder:
    """Begin a recording now.

    Args:
        info: What it states about itself.
        payloads: Payload classes by noun.
        path: Of the finished file.
        before: The recording that it goes on from: what was latched there stands at its beginning.

    Raises:
        RecordingError: It cannot be written.
    """
    now_ns = time.monotonic_ns()
    recorder = Recorder(
        path, info, flush_period_ns=FLUSH_PERIOD_NS, spare_bytes=SPARE_BYTES, begins_ns=now_ns
    )
    if before is not None:
        recorder.record_batch(before.latched.values(), payloads)
    return recorder


def _finish(recorder: Recorder, following: Recorder | None) -> None:
    try:
        recorder.finish()
    except BaseException:
        if following is not None:
            following.discard()
        raise


def _complain(line: str) -> None:
    sys.stderr.write(f"{line}\n")
    sys.stderr.flush()


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


def write_until_end(
    recorder: Recorder,
    batches: "queue.SimpleQueue[bytes | None]",
    bus: ZenohBus,
    process: str,
    payloads: Mapping[str, type[Message]],
    reporter: RecorderReporter | None = None,
    until_ns: int | None = None,
) -> bool:
    """Write until the queue holds None.

    Args:
        recorder: Writes the file.
        batches: Of the record streams, as they come.
        bus: Takes its signs of life.
        process: Its own name.
        payloads: Payload classes by noun.
        reporter: Reports of it.
        until_ns: Or until this moment of the monotonic clock.

    Returns:
        Whether the queue held None.

    Raises:
        LostFileError: With a reporter: the file was deleted, or no path leads to it any more.
        RecordingError: The disk is full, or gone; with a reporter while there is room to finish the file.
    """
    sign_due_ns = 0
    while True:
        now_ns = time.monotonic_ns()
        recorder.tick(now_ns)
        if until_ns is not None and now_ns >= until_ns:
            return False
        if now_ns >= sign_due_ns:  # an empty batch is its sign of life
            sign_due_ns = now_ns + ALIVE_PERIOD_NS
            bus.publish_batch(process, RecordWriter().take())
        if reporter is not None:
            status = reporter.look(now_ns)
            if status is not None:
                if recorder.check_place():
                    _complain(f"the recording was moved: it goes on in {recorder.part_path}")
                recorder.check_room(status.free_bytes)
        try:
            batch = batches.get(timeout=TICK_S)
        except queue.Empty:
            continue
        if batch is None:
            return True
        try:
            entries = read_batch(batch)
        except BatchError as error:
            sys.stderr.write(f"not recorded: {error}\n")
            continue
        unknown = recorder.record_batch(entries, payloads)
        if unknown:
            sys.stderr.write(f"not recorded: {unknown} messages of topics that no part declares\n")
