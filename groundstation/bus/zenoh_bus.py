"""Zenoh between processes: one hub on loopback, every process a client of it.

What this module fixes once, so that nobody else meets it: no scouting, no listening beyond loopback,
no shared memory, callbacks that only append to a queue, BLOCK for what may not be lost and DROP for
what is replaced by the next, commands on a priority of their own, and a session that is closed by a
context manager, since a living subscriber keeps the interpreter from ending.

Keys are ``<owner>/<noun>``; the envelope travels as the attachment. Latched topics are repeated by
their publisher with the same sequence number; receivers drop what they have seen.
"""

import json
from collections.abc import Callable
from types import TracebackType
from typing import Self

import zenoh

from groundstation.bus.envelope import Envelope
from groundstation.bus.topics import Delivery, Topic

RIG_OWNER = "rig"
ALIVE = "alive"
LEASE_MS = 2000

Receive = Callable[[str, bytes, bytes], None]
"""Called with key, payload and attachment from Zenoh's thread: append to a queue and return."""


def _config(mode: str, *, listen: tuple[str, ...] = (), connect: tuple[str, ...] = ()) -> zenoh.Config:
    config = zenoh.Config()
    for key, value in {
        "mode": mode,
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "listen/endpoints": list(listen),
        "connect/endpoints": list(connect),
        "transport/shared_memory/enabled": False,
        "transport/link/tx/lease": LEASE_MS,
    }.items():
        config.insert_json5(key, json.dumps(value))
    return config


def open_hub(endpoint: str) -> zenoh.Session:
    """Open the hub that all processes connect to, e.g. at ``tcp/127.0.0.1:7447``.

    Raises:
        zenoh.ZError: The endpoint is taken.
    """
    return zenoh.open(_config("router", listen=(endpoint,)))


def key_of(topic: Topic, owner: str) -> str:
    """Bus key of a topic of one owner; the owner of rig topics is written ``rig``."""
    return f"{owner or RIG_OWNER}/{topic.noun}"


def split_key(key: str) -> tuple[str, str]:
    """Owner and noun of a key."""
    owner, _, noun = key.rpartition("/")
    return ("" if owner == RIG_OWNER else owner), noun


class ZenohBus:
    """A process's session with the hub; use it as a context manager.

    Args:
        endpoint: Of the hub.

    Raises:
        zenoh.ZError: The hub is not there.
    """

    def __init__(self, endpoint: str) -> None:
        self._session = zenoh.open(_config("client", connect=(endpoint,)))
        self._publishers: dict[str, zenoh.Publisher] = {}
        self._subscribers: list[zenoh.Subscriber[None]] = []
        self._token: zenoh.LivelinessToken | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def publish(self, envelope: Envelope, encoded: bytes) -> None:
        """Send one encoded payload with its envelope."""
        key = key_of(envelope.topic, envelope.vehicle)
        publisher = self._publishers.get(key)
        if publisher is None:
            publisher = self._publishers[key] = self._declare(key, envelope.topic)
        publisher.put(encoded, attachment=envelope.pack())

    def _declare(self, key: str, topic: Topic) -> zenoh.Publisher:
        newest = topic.delivery is Delivery.NEWEST
        return self._session.declare_publisher(
            key,
            congestion_control=zenoh.CongestionControl.DROP if newest else zenoh.CongestionControl.BLOCK,
            priority=zenoh.Priority.DATA_LOW if newest else zenoh.Priority.DATA_HIGH,
            express=not newest,
        )

    def subscribe(self, key_expression: str, receive: Receive) -> None:
        """Hear everything under a key expression; ``receive`` runs on Zenoh's thread."""

        def hear(sample: zenoh.Sample) -> None:
            attachment = sample.attachment
            if attachment is not None:
                receive(str(sample.key_expr), sample.payload.to_bytes(), attachment.to_bytes())

        self._subscribers.append(self._session.declare_subscriber(key_expression, hear))

    def announce(self, process: str) -> None:
        """Tell the others that this process is ready; withdrawn when the process ends, however it ends."""
        self._token = self._session.liveliness().declare_token(f"{ALIVE}/{process}")

    def watch(self, told: Callable[[str, bool], None]) -> None:
        """Be told of every process that becomes ready or goes; runs on Zenoh's thread."""

        def hear(sample: zenoh.Sample) -> None:
            process = str(sample.key_expr).rpartition("/")[2]
            told(process, sample.kind == zenoh.SampleKind.PUT)

        self._subscribers.append(
            self._session.liveliness().declare_subscriber(f"{ALIVE}/*", hear, history=True)
        )

    def close(self) -> None:
        """Withdraw everything and end the session; may be called twice."""
        for subscriber in self._subscribers:
            subscriber.undeclare()
        self._subscribers.clear()
        if self._token is not None:
            self._token.undeclare()
            self._token = None
        if not self._session.is_closed():
            self._session.close()
