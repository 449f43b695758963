"""The recorder's process, ``python -m groundstation.runtime.recorder``: hears the bus and writes it."""

import os
import queue
import sys
import time
from dataclasses import replace
from pathlib import Path

from groundstation.bus.envelope import Envelope
from groundstation.bus.topics import topic_named, topic_of
from groundstation.bus.zenoh_bus import ZenohBus, split_key
from groundstation.messages.definitions import Journal
from groundstation.recording.errors import RecordingError
from groundstation.recording.writer import Recorder
from groundstation.runtime.errors import UsageError
from groundstation.runtime.process import NICENESS, Orders, obey, stop_when_asked
from groundstation.runtime.provenance import recording_info
from groundstation.runtime.rig import parse_rig
from groundstation.runtime.slot import Sequences

TICK_S = 0.05
ALIVE_PERIOD_NS = 1_000_000_000


def run(orders: Orders) -> None:
    """Record until told to stop; what is still in the queue then is written too.

    Raises:
        UsageError: The file cannot be written.
    """
    assert orders.recording is not None
    os.nice(NICENESS)
    rig_path = Path(orders.rig)
    rig = parse_rig(orders.rig_text, rig_path)
    info = recording_info(rig, rig_path, seed=None, utc_offset_ns=orders.utc_offset_ns)
    try:
        recorder = Recorder(Path(orders.recording), replace(info, rig_toml=orders.rig_text))
    except RecordingError as error:
        raise UsageError(str(error)) from error
    with recorder, ZenohBus(orders.endpoint) as bus:
        _record(recorder, bus, orders)


def _record(recorder: Recorder, bus: ZenohBus, orders: Orders) -> None:
    heard: queue.SimpleQueue[tuple[str, bytes, bytes, int] | None] = queue.SimpleQueue()
    latched: dict[tuple[str, str], tuple[int, int]] = {}
    alive_topic, sequences, alive_due_ns = topic_of(Journal), Sequences(orders.sequences_after), 0
    bus.subscribe(
        "*/*", lambda key, data, attachment: heard.put((key, data, attachment, time.monotonic_ns()))
    )
    stop_when_asked(lambda: heard.put(None))
    bus.announce(orders.process)
    while True:
        now_ns = time.monotonic_ns()
        if now_ns >= alive_due_ns:  # an empty journal is its sign of life
            alive_due_ns = now_ns + ALIVE_PERIOD_NS
            number = sequences.next(alive_topic, orders.process)
            sign = Journal(now_ns, "", orders.process, (), b"")
            bus.publish(Envelope(alive_topic, orders.process, number, now_ns), alive_topic.codec.encode(sign))
        try:
            item = heard.get(timeout=TICK_S)
        except queue.Empty:
            recorder.tick(time.monotonic_ns())
            continue
        if item is None:
            return
        key, data, attachment, arrival_ns = item
        owner, noun = split_key(key)
        if owner == orders.process:
            continue
        try:
            topic = topic_named(noun)
            envelope = Envelope.unpack(topic, owner, attachment)
        except (KeyError, ValueError) as error:
            sys.stderr.write(f"not recorded: {key}, which is none of our messages ({error})\n")
            continue
        if topic.latched:  # repeated for late joiners: one is enough
            said = (envelope.sequence, envelope.publish_ns)
            if latched.get((owner, noun)) == said:
                continue
            latched[owner, noun] = said
        recorder.record_encoded(envelope, data, arrival_ns)


if __name__ == "__main__":
    obey(run)
