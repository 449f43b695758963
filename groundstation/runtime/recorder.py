"""The recorder's process, ``python -m groundstation.runtime.recorder``: hears the bus and writes it."""

import queue
import time
from pathlib import Path

from groundstation.bus.envelope import Envelope
from groundstation.bus.topics import topic_named
from groundstation.bus.zenoh_bus import ZenohBus, split_key
from groundstation.recording.writer import Recorder
from groundstation.runtime.process import Orders, read_orders, stop_when_asked
from groundstation.runtime.provenance import recording_info
from groundstation.runtime.rig import load_rig

TICK_S = 0.05


def run(orders: Orders) -> None:
    """Record until told to stop; what is still in the queue then is written too."""
    assert orders.recording is not None
    rig_path = Path(orders.rig)
    info = recording_info(load_rig(rig_path), rig_path, seed=None, utc_offset_ns=orders.utc_offset_ns)
    heard: queue.SimpleQueue[tuple[str, bytes, bytes, int] | None] = queue.SimpleQueue()
    latched: dict[tuple[str, str], int] = {}
    with Recorder(Path(orders.recording), info) as recorder, ZenohBus(orders.endpoint) as bus:
        bus.subscribe(
            "*/*", lambda key, data, attachment: heard.put((key, data, attachment, time.monotonic_ns()))
        )
        stop_when_asked(lambda: heard.put(None))
        bus.announce(orders.process)
        while True:
            try:
                item = heard.get(timeout=TICK_S)
            except queue.Empty:
                recorder.tick(time.monotonic_ns())
                continue
            if item is None:
                break
            key, data, attachment, arrival_ns = item
            owner, noun = split_key(key)
            topic = topic_named(noun)
            envelope = Envelope.unpack(topic, owner, attachment)
            if topic.latched:  # repeated for late joiners: one is enough
                if latched.get((owner, noun)) == envelope.sequence:
                    continue
                latched[owner, noun] = envelope.sequence
            recorder.record_encoded(envelope, data, arrival_ns)


if __name__ == "__main__":
    run(read_orders())
