"""Messages for a guided calibration, in the order of their stamps though they come batch by batch."""

import heapq
import itertools
import time
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from groundstation.bus.cdr import CodecError, codec_of
from groundstation.console.feed import Key
from groundstation.declarations.message import Message

HOLD_NS = 300_000_000
"""Batches of different processes come up to so long after what they hold was published."""
RIG = ""


class WizardTap:
    """Collects what a guide takes.

    A command of one process and the sample of another that shows its effect lie in different batches: both
    are held for a moment and given on by their stamps. A fix is stamped by its exposure, long ago: it comes
    when it is here.

    Args:
        kinds: Classes of the messages.
        vehicle: Whose, or the rig's.

    Attributes:
        keys: Of their topics.
    """

    def __init__(self, kinds: Iterable[type[Message]], vehicle: str) -> None:
        self._kinds = {kind.TOPIC.noun: kind for kind in kinds}
        self.keys: frozenset[Key] = frozenset(
            (noun, owner) for noun in self._kinds for owner in (vehicle, RIG)
        )
        self._numbers = itertools.count()
        self._waiting: list[tuple[int, int, Message]] = []

    def take(self, key: Key, data: NDArray[np.uint8], starts: list[int], stops: list[int]) -> None:
        """Take the messages of one topic of one owner."""
        codec = codec_of(self._kinds[key[0]])
        for start, stop in zip(starts, stops, strict=True):
            try:
                message = codec.decode(data[start:stop].tobytes())
            except CodecError:
                continue  # the feed counts what cannot be read
            heapq.heappush(self._waiting, (message.stamp_ns, next(self._numbers), message))

    def ready(self) -> tuple[list[Message], int]:
        """What has been held long enough, in order, and the moment up to which that is."""
        until_ns = time.monotonic_ns() - HOLD_NS
        found = []
        while self._waiting and self._waiting[0][0] <= until_ns:
            found.append(heapq.heappop(self._waiting)[2])
        return found, until_ns
