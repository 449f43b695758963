"""What programs outside the station send, with arrival stamps: a Zenoh client of its own at the hub.

Zenoh's thread only appends to bounded queues; where more comes than is read, the newest stays and the rest is
counted. Who reads gets at most one handful each ``PAUSE_S``, however fast somebody sends.
"""

import json
import threading
import time
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

import zenoh
from zenoh.handlers import Callback

from drivers.errors import LinkLost, NotFound
from drivers.outside.protocol import LONGEST_BYTES, PREFIX, REQUEST, WRENCH, key_of

PAUSE_S = 0.01
MOST_WRENCHES, MOST_REQUESTS = 4, 32
"""That wait, per vehicle; of wrenches the newest counts, and two programs may send them by mistake."""
LONGEST_KEY = 100
_NOBODYS = ""
"""Queue of what names no vehicle of the rig."""


@dataclass(frozen=True, slots=True)
class OutsideArrival:
    """A text as it arrived.

    Attributes:
        stamp_ns: When, host monotonic clock.
        key: On which key; cut where no key of ours is as long.
        text: Its bytes; of one that is too long the first ones, one more than is allowed.
        replaced: How many older ones on this key were given up since the last that was read.
    """

    stamp_ns: int
    key: str
    text: bytes
    replaced: int


class _Queue:
    def __init__(self, most: int) -> None:
        self.waiting: deque[tuple[int, str, bytes]] = deque(maxlen=most)
        self.replaced = 0

    def put(self, stamp_ns: int, key: str, text: bytes) -> None:
        self.replaced += len(self.waiting) == self.waiting.maxlen
        self.waiting.append((stamp_ns, key, text))

    def take(self) -> Iterable[OutsideArrival]:
        replaced, self.replaced = self.replaced, 0
        for place, (stamp_ns, key, text) in enumerate(self.waiting):
            yield OutsideArrival(stamp_ns, key, text, 0 if place else replaced)
        self.waiting.clear()


class OutsidePort:
    """Texts for the vehicles of a rig, and answers to them.

    Args:
        endpoint: Of the hub, e.g. ``tcp/127.0.0.1:7447``.
        vehicles: Names of the vehicles.

    Raises:
        NotFound: The hub is not there.
    """

    def __init__(self, endpoint: str, vehicles: Iterable[str]) -> None:
        self._queues = {_NOBODYS: _Queue(MOST_WRENCHES)}
        for name in vehicles:
            self._queues[key_of(name, WRENCH)] = _Queue(MOST_WRENCHES)
            self._queues[key_of(name, REQUEST)] = _Queue(MOST_REQUESTS)
        self._news = threading.Condition()
        self._has_news = self._is_closed = False
        self._handed_s = 0.0
        self._endpoint = endpoint
        try:
            self._session = zenoh.open(_config(endpoint))
        except zenoh.ZError as error:
            raise NotFound(f"no hub answers at {endpoint}") from error
        self._subscribers = [
            self._session.declare_subscriber(f"{PREFIX}/*/{noun}", Callback(self._take, indirect=False))
            for noun in (WRENCH, REQUEST)
        ]

    def read(self, timeout_s: float) -> list[OutsideArrival]:
        """What has come, per vehicle in order of arrival; empty after a while of silence.

        Raises:
            LinkLost: The session with the hub has ended.
        """
        with self._news:
            self._news.wait_for(lambda: self._has_news or self._is_closed, timeout_s)
            pause_s = self._handed_s + PAUSE_S - time.monotonic()
            if self._has_news and pause_s > 0.0:
                self._news.wait_for(lambda: self._is_closed, pause_s)
            self._has_news = False
            self._handed_s = time.monotonic()
            found = [arrival for queue in self._queues.values() for arrival in queue.take()]
            is_closed = self._is_closed
        if not found and not is_closed and self._session.is_closed():
            raise LinkLost(f"the session with the hub at {self._endpoint} has ended")
        return sorted(found, key=lambda arrival: arrival.stamp_ns)

    def send(self, key: str, text: str) -> None:
        """Publish an answer; one that nobody takes in time is dropped.

        Raises:
            LinkLost: The hub is gone.
        """
        try:
            self._session.put(key, text, congestion_control=zenoh.CongestionControl.DROP)
        except zenoh.ZError as error:
            raise LinkLost(f"the hub at {self._endpoint} is gone") from error

    def wake(self) -> None:
        """Let a waiting ``read`` return, now and from now on."""
        with self._news:
            self._is_closed = True
            self._news.notify_all()

    def close(self) -> None:
        """End the session; may be called twice."""
        self.wake()
        for subscriber in self._subscribers:
            subscriber.undeclare()
        self._subscribers.clear()
        if not self._session.is_closed():
            self._session.close()

    def _take(self, sample: zenoh.Sample) -> None:
        """Runs on Zenoh's thread."""
        stamp_ns = time.monotonic_ns()
        key, text = str(sample.key_expr)[:LONGEST_KEY], sample.payload.to_bytes()[: LONGEST_BYTES + 1]
        with self._news:
            self._queues.get(key, self._queues[_NOBODYS]).put(stamp_ns, key, text)
            self._has_news = True
            self._news.notify()


def _config(endpoint: str) -> zenoh.Config:
    config = zenoh.Config()
    for key, value in {
        "mode": "client",
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "connect/endpoints": [endpoint],
        "transport/shared_memory/enabled": False,
    }.items():
        config.insert_json5(key, json.dumps(value))
    return config
