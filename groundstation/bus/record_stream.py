"""The record stream: everything that a process published, many messages in one put.

Recorder, view, console and bridges take this stream and cost the flight nothing: two thousand small puts a
second through a hub cost far more than twenty large ones. A batch carries its own names, so that entries
point at them by index and no table of topics is needed to read it.

Layout, little endian: ``magic u32 | names u32 | entries u32 | lengths of names u16 ...`` then the names, the
entries (``_ENTRY``) and the payloads, one after the other.
"""

import struct
from collections.abc import Container, Iterator
from typing import NamedTuple

from groundstation.bus.envelope import Cause, Envelope

MAGIC = 0x32535247  # "GRS2"
_HEAD = struct.Struct("<III")
_ENTRY = struct.Struct("<qIIIHHHHI")
"""publish_ns, sequence, wall_ns, payload's bytes, indices of noun and owner; of the trigger the index of its
noun plus one (0: there is none), the index of its owner and its sequence."""
_LONGEST_NS = 0xFFFFFFFF


class BatchError(ValueError):
    """Bytes that are no batch."""


class RecordWriter:
    """Collects what one process publishes between two puts."""

    def __init__(self) -> None:
        self._names: dict[str, int] = {}
        self._entries: list[bytes] = []
        self._payloads: list[bytes] = []
        self.size = 0

    def __len__(self) -> int:
        return len(self._entries)

    def add(self, envelope: Envelope, encoded: bytes) -> None:
        """Add one message."""
        topic, owner, sequence, publish_ns, wall_ns, trigger = envelope
        names = self._names
        trigger_noun = trigger_owner = trigger_sequence = 0
        if trigger is not None:
            trigger_noun = 1 + names.setdefault(trigger.noun, len(names))
            trigger_owner = names.setdefault(trigger.owner, len(names))
            trigger_sequence = trigger.sequence
        self._entries.append(
            _ENTRY.pack(
                publish_ns,
                sequence,
                wall_ns if wall_ns < _LONGEST_NS else _LONGEST_NS,
                len(encoded),
                names.setdefault(topic.noun, len(names)),
                names.setdefault(owner, len(names)),
                trigger_noun,
                trigger_owner,
                trigger_sequence,
            )
        )
        self._payloads.append(encoded)
        self.size += len(encoded)

    def take(self) -> bytes:
        """The batch so far; the next one begins."""
        names = [name.encode() for name in self._names]
        head = _HEAD.pack(MAGIC, len(names), len(self._entries))
        lengths = struct.pack(f"<{len(names)}H", *map(len, names))
        packed = b"".join((head, lengths, *names, *self._entries, *self._payloads))
        self._names.clear()
        self._entries.clear()
        self._payloads.clear()
        self.size = 0
        return packed


class Recorded(NamedTuple):
    """One message of a batch, its payload not decoded yet; a named tuple, since thousands come a second.

    Attributes:
        noun: Of its topic.
        owner: Vehicle or process, empty for the rig.
        sequence: Of the publication.
        publish_ns: Moment of the publication.
        wall_ns: Wall time that the node took.
        trigger: The message that it answers; None where there is none.
        data: CDR bytes of the payload.
    """

    noun: str
    owner: str
    sequence: int
    publish_ns: int
    wall_ns: int
    trigger: Cause | None
    data: bytes


def read_batch(data: bytes, nouns: Container[str] | None = None) -> Iterator[Recorded]:
    """Messages of a batch, in the order of their publication.

    Args:
        data: The batch.
        nouns: Of the topics that are wanted; None for all.

    Raises:
        BatchError: The bytes are no batch, or are cut off; nothing is yielded then.
    """
    names, rows, position = _table_of(data)
    wanted = [nouns is None or name in nouns for name in names]
    return _messages(data, position, names, wanted, rows)


Place = tuple[int, int, int]
"""Where a payload begins and ends in its batch, and the moment of its publication."""


def places_of(data: bytes) -> dict[tuple[str, str], list[Place]]:
    """Where the payloads of a batch lie, by noun and owner, in the order of their publication.

    For whoever looks at a few of them, or at many of one kind at once: nothing is copied.

    Raises:
        BatchError: The bytes are no batch, or are cut off.
    """
    names, rows, position = _table_of(data)
    found: dict[tuple[int, int], list[Place]] = {}
    for publish_ns, _, _, size, noun, owner, *_ in rows:
        stop = position + size
        places = found.get((noun, owner))
        if places is None:
            places = found[noun, owner] = []
        places.append((position, stop, publish_ns))
        position = stop
    return {(names[noun], names[owner]): places for (noun, owner), places in found.items()}


def _table_of(data: bytes) -> tuple[list[str], list[tuple[int, ...]], int]:
    """Names and entries of a batch, and where its payloads begin.

    Raises:
        BatchError: The bytes are no batch, or are cut off.
    """
    try:
        magic, name_count, entry_count = _HEAD.unpack_from(data)
        if magic != MAGIC:
            raise BatchError(f"no batch of the record stream: it begins with {data[:4].hex()}")
        lengths = struct.unpack_from(f"<{name_count}H", data, _HEAD.size)
        position = _HEAD.size + 2 * name_count
        names = []
        for length in lengths:
            names.append(data[position : position + length].decode())
            position += length
        stop = position + entry_count * _ENTRY.size
        rows = list(_ENTRY.iter_unpack(data[position:stop]))
        if (
            stop + sum([row[3] for row in rows]) != len(data)
            or len(rows) != entry_count
            or (rows and not _are_named(rows, name_count))
        ):
            raise BatchError("a batch of the record stream is cut off")
    except (struct.error, ValueError) as error:
        if isinstance(error, BatchError):
            raise
        raise BatchError(f"a batch of the record stream is cut off ({error})") from error
    return names, rows, stop


def _are_named(rows: list[tuple[int, ...]], count: int) -> bool:
    """Whether all entries point at one of the ``count`` names of their batch."""
    columns: list[tuple[int, ...]] = list(zip(*rows, strict=True))
    nouns, owners, trigger_nouns, trigger_owners = columns[4:8]
    return max(nouns + owners + trigger_owners) < count and max(trigger_nouns) <= count


def _messages(
    data: bytes,
    position: int,
    names: list[str],
    wanted: list[bool],
    rows: list[tuple[int, ...]],
) -> Iterator[Recorded]:
    made = tuple.__new__  # a third of the time of calling a named tuple
    for publish_ns, sequence, wall_ns, size, noun, owner, of_noun, of_owner, at in rows:
        stop = position + size
        if wanted[noun]:
            trigger = made(Cause, (names[of_noun - 1], names[of_owner], at)) if of_noun else None
            payload = data[position:stop]
            yield made(
                Recorded,
                (names[noun], names[owner], sequence, publish_ns, wall_ns, trigger, payload),
            )
        position = stop
