"""The one listener: decodes the bus for whoever wants messages, and drops repeated latched values.

Callbacks only append to a queue; decoding happens where the messages are taken.
"""

import queue
from collections.abc import Mapping
from typing import NamedTuple, TypeVar

from groundstation.bus.cdr import CodecError, codec_of
from groundstation.bus.envelope import Delivered, Envelope
from groundstation.bus.zenoh_bus import ZenohBus, key_of, split_key
from groundstation.declarations.message import Message

M = TypeVar("M", bound=Message)


class Remote(NamedTuple):
    """A message from the bus, not decoded yet."""

    key: str
    payload: bytes
    attachment: bytes


class Decoder:
    """Makes messages of what came from the bus.

    Args:
        payloads: Payload classes by noun.

    Attributes:
        undecodable: How many came that were none of these.
    """

    def __init__(self, payloads: Mapping[str, type[Message]]) -> None:
        self._payloads = payloads
        self._latched: dict[str, tuple[int, int]] = {}
        self.undecodable = 0

    def envelope(self, remote: Remote) -> Envelope | None:
        """Its envelope alone; None for something that is no message of ours."""
        owner, noun = split_key(remote.key)
        kind = self._payloads.get(noun)
        if kind is None:
            self.undecodable += 1
            return None
        try:
            return Envelope.of_attachment(kind.TOPIC, owner, remote.attachment)
        except ValueError:
            self.undecodable += 1
            return None

    def decode(self, remote: Remote) -> Delivered | None:
        """The message; None if it is none of ours, or a latched one that was here before."""
        envelope = self.envelope(remote)
        if envelope is None:
            return None
        if envelope.topic.latched:
            published = (envelope.sequence, envelope.publish_ns)
            if self._latched.get(remote.key) == published:
                return None
            self._latched[remote.key] = published
        try:
            payload = codec_of(self._payloads[envelope.topic.noun]).decode(remote.payload)
        except CodecError:
            self.undecodable += 1
            return None
        return Delivered(envelope, payload)


class Listener:
    """Subscribes to topics and hands over their messages, in order of arrival.

    Args:
        bus: Session with the hub.
        kinds: Payload classes to receive.
        owner: Of whom, a vehicle or process; ``*`` for all.
    """

    def __init__(self, bus: ZenohBus, kinds: tuple[type[Message], ...], owner: str = "*") -> None:
        self._decoder = Decoder({kind.TOPIC.noun: kind for kind in kinds})
        self._queue: queue.SimpleQueue[Remote] = queue.SimpleQueue()
        put = self._queue.put
        for kind in kinds:
            bus.subscribe(key_of(kind.TOPIC, owner), lambda *came: put(Remote(*came)))

    @property
    def has_some(self) -> bool:
        """Whether anything waits to be taken."""
        return not self._queue.empty()

    def take(self, timeout_s: float) -> Delivered | None:
        """The next message, waited for up to ``timeout_s``; None where none came that can be decoded."""
        try:
            remote = self._queue.get(timeout=timeout_s) if timeout_s > 0 else self._queue.get_nowait()
        except queue.Empty:
            return None
        return self._decoder.decode(remote)
