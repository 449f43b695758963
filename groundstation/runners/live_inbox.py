"""What waits for the loop of a live process: threads of devices and of the bus put it in."""

import queue
import threading
from collections import deque
from dataclasses import dataclass, field
from typing import NamedTuple

from groundstation.bus.listener import Remote
from groundstation.declarations.port import Port
from groundstation.declarations.topic import Delivery

MOST_URGENT = 256
"""Presses of a stop that wait; so many are one press that is repeated, and the newest ones say it as well."""


class FromPort(NamedTuple):
    """What a device delivered, and when it arrived."""

    port: Port
    stamp_ns: int
    data: object


class Gone(NamedTuple):
    """A process of the run has ended, however it ended."""

    process: str


class _Newest(NamedTuple):
    """Something under this key waits in the box of newest items."""

    key: str


@dataclass(slots=True)
class Taken:
    """One item, and the attachments of the messages from the bus that it replaced before anybody looked."""

    item: Remote | FromPort | Gone
    replaced: list[bytes] = field(default_factory=list)


class Inbox:
    """One queue in order of arrival; of topics with newest delivery it holds one item each. Thread-safe.

    What is urgent is taken before everything else that waits.
    """

    def __init__(self) -> None:
        self._queue: queue.SimpleQueue[Remote | FromPort | Gone | _Newest | Exception | None] = (
            queue.SimpleQueue()
        )
        self._urgent: deque[Remote] = deque(maxlen=MOST_URGENT)
        self._newest: dict[str, Taken] = {}
        self._lock = threading.Lock()

    def put(self, key: str, item: Remote | FromPort, delivery: Delivery) -> None:
        """Append, or replace what waits under this key if only the newest counts."""
        if delivery is Delivery.EVERY:
            self._queue.put(item)
            return
        with self._lock:
            waiting = self._newest.get(key)
            if waiting is None:
                self._newest[key] = Taken(item)
            else:
                if isinstance(waiting.item, Remote):
                    waiting.replaced.append(waiting.item.attachment)
                waiting.item = item
        if waiting is None:
            self._queue.put(_Newest(key))

    def put_urgent(self, item: Remote) -> None:
        """Put before everything that waits, but behind what is as urgent; beyond a limit the oldest goes."""
        self._urgent.append(item)
        self.wake()

    def put_gone(self, process: str) -> None:
        """Append the end of a process, behind what came from it."""
        self._queue.put(Gone(process))

    def fail(self, error: Exception) -> None:
        """A thread met a bug: ``take`` raises it in the loop."""
        self._queue.put(error)

    def wake(self) -> None:
        """Let ``take`` return at once."""
        self._queue.put(None)

    def take(self, timeout_s: float) -> Taken | None:
        """The next item, waited for up to ``timeout_s``; None if there is none or at a ``wake``.

        Raises:
            Exception: What a thread handed to ``fail``.
        """
        urgent = self._take_urgent()
        if urgent is not None:
            return urgent
        try:
            item = self._queue.get(timeout=timeout_s) if timeout_s > 0 else self._queue.get_nowait()
        except queue.Empty:
            return None
        if item is None:
            return self._take_urgent()
        if isinstance(item, Exception):
            raise item
        if isinstance(item, _Newest):
            with self._lock:
                return self._newest.pop(item.key)
        return Taken(item)

    def _take_urgent(self) -> Taken | None:
        return Taken(self._urgent.popleft()) if self._urgent else None
