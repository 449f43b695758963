"""Numbers for the charts of one screen, read of many messages at once."""

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from groundstation.bus.cdr import CodecError
from groundstation.bus.cdr_columns import decode_columns
from groundstation.bus.fields import Field, fields_of
from groundstation.console.feed import Key
from groundstation.declarations.message import Message

MOST_SAMPLES = 40_000
"""Of a field between two frames: beyond that the oldest are dropped, and their number is reported."""
Samples = tuple[NDArray[np.float64], NDArray[np.float64]]


class UnknownFieldError(ValueError):
    """No topic has a field of this name."""


class ChartTap:
    """Collects some fields between two frames.

    Args:
        names: Of the fields, as ``str(Field)`` writes them.
        payloads: Payload classes by noun.

    Attributes:
        keys: Of the topics that it wants.
        fields: By their names.

    Raises:
        UnknownFieldError: A topic has no such number.
    """

    def __init__(self, names: Iterable[str], payloads: Mapping[str, type[Message]]) -> None:
        self._payloads = payloads
        self.fields = {name: find_field(name, payloads) for name in names}
        self._wanted: dict[Key, list[tuple[str, Field]]] = {}
        for name, field in self.fields.items():
            self._wanted.setdefault((field.noun, field.owner), []).append((name, field))
        self.keys = frozenset(self._wanted)
        self._pieces: dict[str, list[Samples]] = {}

    def take(self, key: Key, data: NDArray[np.uint8], starts: list[int], stops: list[int]) -> None:
        """Take the messages of one topic of one owner."""
        wanted = self._wanted[key]
        names = {field.name for _, field in wanted}
        try:
            columns = decode_columns(
                self._payloads[key[0]],
                names,
                data,
                np.array(starts, np.int64),
                np.array(stops, np.int64),
            )
        except CodecError:
            return  # the feed counts what cannot be read
        times_s = columns.stamp_ns.astype(np.float64) * 1e-9
        for name, field in wanted:
            values = columns[field.name]
            if field.place is not None:
                values = values[:, field.place]
            self._pieces.setdefault(name, []).append((times_s, values.astype(np.float64)))

    def samples(self) -> dict[str, Samples]:
        """Times (s of the host's monotonic clock) and values of each field since the last call."""
        found = {}
        for name, pieces in self._pieces.items():
            times_s = np.concatenate([piece[0] for piece in pieces])[-MOST_SAMPLES:]
            found[name] = times_s, np.concatenate([piece[1] for piece in pieces])[-MOST_SAMPLES:]
        self._pieces.clear()
        return found


def find_field(name: str, payloads: Mapping[str, type[Message]]) -> Field:
    """The field of a name.

    Raises:
        UnknownFieldError: There is none.
    """
    topic, _, _ = name.partition(".")
    owner, _, noun = topic.rpartition("/")
    kind = payloads.get(noun)
    if kind is None:
        raise UnknownFieldError(f"{name!r:.80}: there is no topic {noun!r:.40}")
    for field in fields_of(kind, "" if owner == "rig" else owner):
        if str(field) == name:
            return field
    raise UnknownFieldError(f"{name!r:.80} is no number of {noun!r:.40}")
