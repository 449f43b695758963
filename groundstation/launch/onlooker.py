"""The loop of an attendant that only looks on, such as a bridge: all that is published, and signs of life."""

import os
import sys
import threading
import time
from collections.abc import Callable, Collection

from groundstation.bus.record_stream import BatchError, Recorded, RecordWriter, read_batch
from groundstation.bus.zenoh_bus import RECORD, ZenohBus
from groundstation.launch.orders import Orders
from groundstation.launch.process import NICENESS, stop_when_asked

MOST_BATCHES = 1024
"""That wait; an onlooker that is slow misses the oldest, and the flight never waits."""
POLL_S = 0.02
SIGN_S = 1.0


def look_on(
    orders: Orders,
    take: Callable[[Recorded], None],
    latched: Collection[str],
    tick: Callable[[], None] = lambda: None,
) -> None:
    """Hand over all that is published until asked to stop; latched messages come again each second.

    Args:
        orders: Of this process.
        take: Takes a message.
        latched: Nouns of latched topics.
        tick: Called some times a second.
    """
    os.nice(NICENESS)
    stopping = threading.Event()
    newest: dict[tuple[str, str], int] = {}
    stop_when_asked(stopping.set)
    with ZenohBus(orders.endpoint) as bus:
        batches = bus.collect(f"{RECORD}/*", MOST_BATCHES)
        bus.announce(orders.process)
        sign_due_s = 0.0
        while not stopping.wait(POLL_S):
            now_s = time.monotonic()
            if now_s >= sign_due_s:  # an empty batch is its sign of life
                sign_due_s = now_s + SIGN_S
                bus.publish_batch(orders.process, RecordWriter().take())
            tick()
            for _, batch in batches.take():
                try:
                    entries = read_batch(batch)
                except BatchError as error:
                    sys.stderr.write(f"passed over: {error}\n")
                    continue
                for entry in entries:
                    key = entry.noun, entry.owner
                    if entry.noun not in latched and entry.sequence <= newest.get(key, 0):
                        continue  # what others testify to of a process that died
                    newest[key] = entry.sequence
                    take(entry)
