"""What the console knows: the newest message of everything, and what charts and lists are fed with.

Thousands of messages come a second and a screen is drawn twenty times: bytes are kept as they came, and read
when somebody looks.
"""

from collections import Counter
from collections.abc import Callable, Mapping
from typing import NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from groundstation.bus.cdr import CodecError, codec_of
from groundstation.bus.record_stream import BatchError, places_of
from groundstation.declarations.message import Message

M = TypeVar("M", bound=Message)
Key = tuple[str, str]
"""Noun and owner."""


class Came(NamedTuple):
    """The newest of one topic of one owner.

    Attributes:
        data: CDR bytes of the payload.
        arrived_ns: When it came here, on the host's clock.
    """

    data: bytes
    arrived_ns: int


class Tap(Protocol):
    """Takes all messages of some topics, still in their batch."""

    keys: frozenset[Key]

    def take(self, key: Key, data: NDArray[np.uint8], starts: list[int], stops: list[int]) -> None:
        """Take the messages of one topic of one owner that a batch holds, in order."""


class Feed:
    """Takes batches of the record stream, answers with the newest.

    Args:
        payloads: Payload classes by noun.

    Attributes:
        newest: Of each noun and owner.
        counts: Messages that came, by noun and owner.
        refused: Batches and messages that could not be read.
    """

    def __init__(self, payloads: Mapping[str, type[Message]]) -> None:
        self._payloads = payloads
        self.newest: dict[Key, Came] = {}
        self.counts: Counter[Key] = Counter()
        self.refused = 0
        self._read: dict[Key, tuple[bytes, Message]] = {}
        self._takers: dict[str, list[Callable[[Message, str], None]]] = {}
        self._taps: list[Tap] = []

    def on(self, kind: type[M], take: Callable[[M, str], None]) -> None:
        """Let each message of a class be taken, decoded, with its owner."""
        self._takers.setdefault(kind.TOPIC.noun, []).append(take)  # type: ignore[arg-type]

    def is_taken(self, kind: type[Message]) -> bool:
        """Whether anybody takes each message of a class."""
        return kind.TOPIC.noun in self._takers

    def tap(self, tap: Tap) -> None:
        """Let somebody have what he names, until ``untap``."""
        self._taps.append(tap)

    def untap(self, tap: Tap) -> None:
        """End that."""
        self._taps.remove(tap)

    def take_batch(self, batch: bytes, now_ns: int) -> None:
        """Take one batch of the record stream."""
        try:
            found = places_of(batch)
        except BatchError:
            self.refused += 1
            return
        for key, places in found.items():
            start, stop, _ = places[-1]
            self.newest[key] = Came(batch[start:stop], now_ns)
            self.counts[key] += len(places)
            takers = self._takers.get(key[0])
            if takers is not None:
                for start, stop, _ in places:
                    self._give(key, batch[start:stop])
        for tap in self._taps:
            wanted = tap.keys & found.keys()
            if wanted:
                data = np.frombuffer(batch, np.uint8)
                for key in wanted:
                    starts, stops, _ = zip(*found[key], strict=True)
                    tap.take(key, data, list(starts), list(stops))

    def take_one(self, key: Key, data: bytes, now_ns: int) -> None:
        """Take one message: of a recording, which holds no batches."""
        self.newest[key] = Came(data, now_ns)
        self.counts[key] += 1
        if key[0] in self._takers:
            self._give(key, data)
        for tap in self._taps:
            if key in tap.keys:
                tap.take(key, np.frombuffer(data, np.uint8), [0], [len(data)])

    def get(self, kind: type[M], owner: str) -> M | None:
        """The newest message of a class and owner; None before the first, or where it cannot be read."""
        key = (kind.TOPIC.noun, owner)
        came = self.newest.get(key)
        if came is None:
            return None
        read = self._read.get(key)
        if read is None or read[0] is not came.data:
            try:
                read = (came.data, codec_of(kind).decode(came.data))
            except CodecError:
                self.refused += 1
                return None
            self._read[key] = read
        message = read[1]
        return message if isinstance(message, kind) else None

    def arrived_ns(self, kind: type[Message], owner: str) -> int | None:
        """When the newest of a class and owner came; None before the first."""
        came = self.newest.get((kind.TOPIC.noun, owner))
        return None if came is None else came.arrived_ns

    def forget(self) -> None:
        """Know nothing: a replay jumps."""
        self.newest.clear()
        self._read.clear()

    def _give(self, key: Key, data: bytes) -> None:
        try:
            message = codec_of(self._payloads[key[0]]).decode(data)
        except (CodecError, KeyError):
            self.refused += 1
            return
        for take in self._takers[key[0]]:
            take(message, key[1])
