"""A rig that runs, seen from another process: what its record streams carry, until it ends."""

import time
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager

from groundstation.bus.cdr import CodecError
from groundstation.bus.record_stream import BatchError, Recorded, read_batch
from groundstation.bus.zenoh_bus import RECORD, Mailbox
from groundstation.declarations.message import Message
from groundstation.launch.asking import session_with
from groundstation.launch.running import RunningRig, find_running
from groundstation.watch.pick import Pick

MOST_BATCHES = 1024
"""That wait, some seconds of a rig; whoever looks too rarely misses the oldest, and the rig never waits."""
POLL_S = 0.05
SILENT_S = 3.0
LOOKED_S = 1.0


class Observer:
    """Takes what a rig publishes; it costs the rig nothing, since record streams flow anyway.

    Args:
        batches: Of its record streams.
        nouns: Of the topics that are wanted; None for all.

    Attributes:
        unreadable: Batches that were none.
    """

    def __init__(self, batches: Mailbox, nouns: Collection[str] | None) -> None:
        self._batches = batches
        self._nouns = nouns
        self._newest: dict[tuple[str, str], int] = {}
        self.unreadable = 0

    def take(self) -> Iterator[Recorded]:
        """What has come since the last call, each message once, in the order of its process."""
        newest = self._newest
        for _, batch in self._batches.take():
            try:
                entries = read_batch(batch, self._nouns)
            except BatchError:
                self.unreadable += 1
                continue
            for entry in entries:
                key = entry.noun, entry.owner
                if entry.sequence > newest.get(key, 0):  # latched ones are repeated
                    newest[key] = entry.sequence
                    yield entry


@contextmanager
def observing(endpoint: str, nouns: Collection[str] | None) -> Iterator[Observer]:
    """Observe a run.

    Args:
        endpoint: Of its hub.
        nouns: Of the topics that are wanted; None for all.

    Raises:
        GroundStationError: Its hub is not there.
    """
    with session_with(endpoint) as bus:
        yield Observer(bus.collect(f"{RECORD}/*", MOST_BATCHES), nouns)


def follow(run: RunningRig, pick: Pick, every_s: float, note: Callable[[str], None]) -> Iterator[Message]:
    """Messages that are picked, until the run ends.

    Args:
        run: Of the rig.
        pick: What is wanted.
        every_s: The newest so often; 0 for every one.
        note: Takes a line where nothing comes, or what comes cannot be read.

    Raises:
        GroundStationError: Its hub is not there.
    """
    due_s = 0.0
    began_s = looked_s = time.monotonic()
    waiting: Message | None = None
    is_silent = True
    with observing(run.endpoint, {pick.kind.TOPIC.noun}) as observer:
        while True:
            for recorded in observer.take():
                try:
                    message = pick.message(recorded)
                except CodecError as error:
                    note(str(error))
                    continue
                if message is None:
                    continue
                is_silent = False
                if every_s <= 0.0:
                    yield message
                else:
                    waiting = message
            now_s = time.monotonic()
            if waiting is not None and now_s >= due_s:
                due_s = max(due_s + every_s, now_s + every_s - POLL_S)
                yield waiting
                waiting = None
            if is_silent and now_s - began_s > SILENT_S:
                is_silent = False
                note(f"nothing has been published there for {SILENT_S:g} s; Ctrl-C ends")
            if now_s - looked_s > LOOKED_S:
                looked_s = now_s
                if run not in find_running():
                    return
            time.sleep(POLL_S)  # a mailbox is looked into: no thread of Python waits for it
