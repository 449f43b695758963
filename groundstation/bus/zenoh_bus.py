"""Zenoh between processes: one hub on loopback, every process a client of it.

What this module fixes once, so that nobody else meets it: no scouting, no listening beyond loopback,
no shared memory, callbacks that only append to a queue, BLOCK for what may not be lost and DROP for
what is replaced by the next, and a session that is closed by a context manager, since a living subscriber
keeps the interpreter from ending.

Two planes. ``<owner>/<noun>`` carries a topic at once, for the processes that wait for it and for whoever
else subscribes to it; ``record/<process>`` carries everything that a process published, in batches.
``<owner>/<noun>/paced`` carries the first message of each period of a topic's pace, for those who need no
more.
Latched topics are repeated by their publisher with the same sequence number.
"""

import json
import time
from collections.abc import Callable, Mapping
from functools import lru_cache
from types import MappingProxyType, TracebackType
from typing import Any, Self, TypeVar

import zenoh
from zenoh.handlers import Callback, Handler, RingChannel

from groundstation.declarations.errors import GroundStationError
from groundstation.declarations.topic import Delivery, Topic

RIG_OWNER = "rig"
ALIVE = "alive"
RECORD = "record"
PACED = "/paced"
LEASE_MS = 10_000
"""A process that is paused for a few seconds keeps its links, and what is under way in them."""
SUBSCRIBERS_KNOWN_NS = 1_000_000_000
"""The hub reports subscribers within milliseconds of a publisher's declaration; on a busy machine, later."""

T = TypeVar("T")


class HubError(GroundStationError):
    """The hub cannot be opened or reached."""


Receive = Callable[[str, bytes, bytes], None]
"""Called with key, payload and attachment from Zenoh's thread: append to a queue and return."""


def _config(mode: str, *, listen: tuple[str, ...] = (), connect: tuple[str, ...] = ()) -> zenoh.Config:
    config = zenoh.Config()
    for key, value in {
        "mode": mode,
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "scouting/delay": 0,  # else opening the hub takes half a second of waiting for nobody
        "listen/endpoints": list(listen),
        "connect/endpoints": list(connect),
        "transport/shared_memory/enabled": False,
        "transport/link/tx/lease": LEASE_MS,
    }.items():
        config.insert_json5(key, json.dumps(value))
    return config


def client_config(endpoint: str) -> zenoh.Config:
    """Of a session that connects to one place and is found nowhere."""
    return _config("client", connect=(endpoint,))


def open_hub(
    endpoint: str, also_at: tuple[str, ...] = (), settings: Mapping[str, Any] = MappingProxyType({})
) -> zenoh.Session:
    """Open the hub that all processes connect to, e.g. at ``tcp/127.0.0.1:7447``.

    Args:
        endpoint: Where this host's processes connect.
        also_at: Where others do.
        settings: Zenoh's, by their keys: what others must show, and what they may do.

    Raises:
        HubError: The endpoint is taken, or there is no such network.
    """
    config = _config("router", listen=(endpoint, *also_at))
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return _open("opened", " and ".join((endpoint, *also_at)), config)


def _open(what: str, endpoint: str, config: zenoh.Config) -> zenoh.Session:
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        reason = str(error).partition(" at /")[0].strip(" !.")  # behind it stands a line of Zenoh's source
        raise HubError(f"the hub at {endpoint} cannot be {what}: {reason}") from error


def key_of(topic: Topic, owner: str, *, paced: bool = False) -> str:
    """Bus key of a topic of one owner; the owner of rig topics is written ``rig``."""
    return f"{owner or RIG_OWNER}/{topic.noun}{PACED if paced else ''}"


@lru_cache(1024)  # a run has some hundred keys, and each message bears one
def split_key(key: str) -> tuple[str, str]:
    """Owner and noun of a key."""
    owner, _, noun = key.removesuffix(PACED).rpartition("/")
    return ("" if owner == RIG_OWNER else owner), noun


def _direct(receive: Callable[[T], None]) -> "Callback[T]":
    """Let Zenoh's own thread call: a thread for each subscriber costs memory and a switch per message."""
    return Callback(receive, indirect=False)


class TopicPublisher:
    """Publishes one topic of one owner on its own key, to whoever subscribes."""

    def __init__(self, session: zenoh.Session, key: str, topic: Topic) -> None:
        newest = topic.delivery is Delivery.NEWEST
        priority = zenoh.Priority.DATA_LOW if newest else zenoh.Priority.DATA_HIGH
        if topic.is_apart:
            priority = zenoh.Priority.REAL_TIME
        self._publisher = session.declare_publisher(
            key,
            congestion_control=zenoh.CongestionControl.DROP if newest else zenoh.CongestionControl.BLOCK,
            priority=priority,
            express=not newest,
        )
        self._has_subscribers = False
        self._known_ns = time.monotonic_ns() + SUBSCRIBERS_KNOWN_NS
        self._listener = self._publisher.declare_matching_listener(_direct(self._match))

    @property
    def is_wanted(self) -> bool:
        """Whether somebody subscribes, or may subscribe: the hub has not had the time to report it."""
        return self._has_subscribers or time.monotonic_ns() < self._known_ns

    def _match(self, status: zenoh.MatchingStatus) -> None:
        self._has_subscribers = status.matching

    def put(self, encoded: bytes, attachment: bytes) -> None:
        """Send one encoded payload."""
        self._publisher.put(encoded, attachment=attachment)

    def close(self) -> None:
        """Stop listening for subscribers."""
        self._listener.undeclare()


class Mailbox:
    """What came under a key expression, kept by Zenoh until it is taken: no thread of Python runs for it.

    Args:
        handler: Drops its oldest sample when it is full.
    """

    def __init__(self, handler: "Handler[zenoh.Sample]") -> None:
        self._handler = handler

    def take(self) -> list[tuple[str, bytes]]:
        """Keys and payloads of all that waits, in order of arrival."""
        found = []
        while (sample := self._handler.try_recv()) is not None:
            found.append((str(sample.key_expr), sample.payload.to_bytes()))
        return found


class ZenohBus:
    """A process's session with the hub; use it as a context manager.

    Args:
        endpoint: Of the hub.
        is_hub: This process is the hub; what it receives itself then passes through a thread of its own,
            since an interpreter that is busy must not keep the hub from passing on.
        also_at: Of a hub: where programs of other hosts connect.
        settings: Of a hub: Zenoh's, by their keys.

    Raises:
        HubError: The hub is not there; or the endpoint is taken.
    """

    def __init__(
        self,
        endpoint: str,
        *,
        is_hub: bool = False,
        also_at: tuple[str, ...] = (),
        settings: Mapping[str, Any] = MappingProxyType({}),
    ) -> None:
        self._is_hub = is_hub
        client = client_config(endpoint)
        self._session = (
            open_hub(endpoint, also_at, settings) if is_hub else _open("reached", endpoint, client)
        )
        self._publishers: list[TopicPublisher] = []
        self._at_once: dict[tuple[str, str], TopicPublisher] = {}
        self._record: zenoh.Publisher | None = None
        self._subscribers: list[zenoh.Subscriber[Any]] = []
        self._token: zenoh.LivelinessToken | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def publisher(self, topic: Topic, owner: str, *, paced: bool = False) -> TopicPublisher:
        """A publisher of a topic of an owner.

        Args:
            topic: The topic.
            owner: Vehicle or process, empty for the rig.
            paced: On the key of those who take it paced.
        """
        made = TopicPublisher(self._session, key_of(topic, owner, paced=paced), topic)
        self._publishers.append(made)
        return made

    def put(self, topic: Topic, owner: str, encoded: bytes, attachment: bytes) -> None:
        """Publish one encoded payload at once, whether or not a subscriber has been noticed."""
        publisher = self._at_once.get((topic.noun, owner))
        if publisher is None:
            publisher = self._at_once[topic.noun, owner] = self.publisher(topic, owner)
        publisher.put(encoded, attachment)

    def publish_batch(self, process: str, batch: bytes) -> None:
        """Send a batch of the record stream; blocks while the hub does not take it."""
        if self._record is None:
            self._record = self._session.declare_publisher(
                f"{RECORD}/{process}",
                congestion_control=zenoh.CongestionControl.BLOCK,
                priority=zenoh.Priority.DATA,
                express=True,
            )
        self._record.put(batch)

    def subscribe(self, key_expression: str, receive: Receive) -> None:
        """Receive everything under a key expression; ``receive`` runs on Zenoh's thread."""

        def take(sample: zenoh.Sample) -> None:
            attachment = sample.attachment
            receive(
                str(sample.key_expr),
                sample.payload.to_bytes(),
                b"" if attachment is None else attachment.to_bytes(),
            )

        callback = Callback(take, indirect=self._is_hub)
        self._subscribers.append(self._session.declare_subscriber(key_expression, callback))

    def collect(self, key_expression: str, most: int) -> Mailbox:
        """Keep the newest ``most`` samples under a key expression for whoever takes them when he looks."""
        subscriber = self._session.declare_subscriber(key_expression, RingChannel(most))
        self._subscribers.append(subscriber)
        return Mailbox(subscriber.handler)

    def keep_wanted(self, key_expression: str) -> None:
        """Let publishers always find a subscriber under a key expression, and send to the hub.

        They are told of a subscriber that comes while they run some milliseconds later: too late for the
        answer to a request that follows at once. The hub itself knows the subscriber before the request.
        """
        self.collect(key_expression, 1)

    def announce(self, process: str) -> None:
        """Tell the others that this process is ready; withdrawn when the process ends, however it ends."""
        self._token = self._session.liveliness().declare_token(f"{ALIVE}/{process}")

    def watch(self, given: Callable[[str, bool], None]) -> None:
        """Be told of every process that becomes ready or goes; runs on Zenoh's thread."""

        def take(sample: zenoh.Sample) -> None:
            process = str(sample.key_expr).rpartition("/")[2]
            given(process, sample.kind == zenoh.SampleKind.PUT)

        callback = Callback(take, indirect=self._is_hub)
        self._subscribers.append(
            self._session.liveliness().declare_subscriber(f"{ALIVE}/*", callback, history=True)
        )

    def close(self) -> None:
        """Withdraw everything and end the session; may be called twice."""
        for publisher in self._publishers:
            publisher.close()
        self._publishers.clear()
        for subscriber in self._subscribers:
            subscriber.undeclare()
        self._subscribers.clear()
        if self._token is not None:
            self._token.undeclare()
            self._token = None
        if not self._session.is_closed():
            self._session.close()
