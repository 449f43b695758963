"""The journal: what each node consumed and published, in the order only its runner knows.

Replay follows it. A process packs entries of fixed size and publishes them as ``Journal`` payloads; an entry
is read against the names (nodes, nouns and owners) that stand in the same payload.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.bus.cdr import CodecError
from groundstation.declarations.message import PACKAGE, Bytes, Message, Text, TextSequence
from groundstation.declarations.topic import Scope, Topic


@dataclass(frozen=True, slots=True, eq=False)
class Journal(Message):
    """What one process consumed and published, in order: packed entries of ``bus.journal``.

    Attributes:
        process: Its name.
        names: What the entries point into.
        entries: Packed, see ``ENTRY``.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/Journal"
    TOPIC: ClassVar = Topic("journal", 10, scope=Scope.PROCESS)
    process: Text
    names: TextSequence
    entries: Bytes

    def check(self) -> None:
        """Refuse entries that are cut off, or point to names that are not there."""
        if len(self.entries) % ENTRY.itemsize:
            raise CodecError(f"Journal: {len(self.entries)} bytes are no whole entries")
        packed = packed_entries(self)
        nodes = packed["node"][packed["node"] != NO_NODE]
        for index in (nodes, packed["noun"], packed["owner"]):
            if len(index) and int(index.max()) >= len(self.names):
                raise CodecError(f"Journal: an entry points to name {int(index.max())} of {len(self.names)}")
        if len(packed) and int(packed["kind"].max()) > max(Kind):
            raise CodecError(f"Journal: an entry of kind {int(packed['kind'].max())}, which there is not")


class Kind(IntEnum):
    """What happened."""

    START = 0  # the node was started in the process that stands as owner; sequence is 0
    INPUT = 1  # the node consumed (noun, owner, sequence)
    TICK = 2  # the node was ticked
    OUTPUT = 3  # the node published (noun, owner, sequence)
    DROP = 4  # (noun, owner, sequence) was replaced by a newer one before the node took it
    PORT = 5  # a port of the process turned something outside into (noun, owner, sequence)
    STOP = 6  # the node was given that its process ends


ENTRY = np.dtype(
    [
        ("now_ns", "<i8"),
        ("sequence", "<u4"),
        ("wall_ns", "<u4"),
        ("kind", "u1"),
        ("_pad", "u1"),
        ("node", "<u2"),  # index in names; 0xFFFF for PORT
        ("noun", "<u2"),  # index in names
        ("owner", "<u2"),  # index in names
    ]
)
_pack = struct.Struct("<qIIBBHHH").pack  # ENTRY, at half the time that NumPy takes
NO_NODE = 0xFFFF
_LONGEST_NS = 0xFFFFFFFF


class Entry(NamedTuple):
    """One entry, read back.

    Attributes:
        now_ns: The moment the node was told.
        kind: What happened.
        node: Key of the node, empty for a port.
        noun: Of the topic, empty where there is none.
        owner: Of the topic.
        sequence: Of the message.
        wall_ns: Time it took, 0 in lockstep.
    """

    now_ns: int
    kind: int
    node: str
    noun: str
    owner: str
    sequence: int
    wall_ns: int


class _Indices(dict[str, int]):
    """Numbers names in the order in which they are first looked up."""

    def __missing__(self, name: str) -> int:
        index = self[name] = len(self)
        return index


class JournalWriter:
    """Collects the entries of one process between two publications.

    Class attributes:
        is_kept: Whether entries are kept; who has thousands of them a second asks before it notes them.
    """

    is_kept: ClassVar[bool] = True

    def __init__(self) -> None:
        self._names = _Indices()
        self._rows: list[bytes] = []

    def __len__(self) -> int:
        return len(self._rows)

    def note(
        self,
        kind: Kind,
        node: str | None,
        noun: str,
        owner: str,
        sequence: int,
        now_ns: int,
        wall_ns: int = 0,
    ) -> None:
        """Add one entry.

        Args:
            kind: What happened.
            node: Its key, ``name`` or ``vehicle/name``; None for a port.
            noun: Of the topic, empty where there is none.
            owner: Vehicle or process of the topic.
            sequence: Of the message.
            now_ns: The moment the node was told.
            wall_ns: Time it took, 0 in lockstep.
        """
        names = self._names
        if wall_ns > _LONGEST_NS:
            wall_ns = _LONGEST_NS
        index = NO_NODE if node is None else names[node]
        self._rows.append(_pack(now_ns, sequence, wall_ns, kind, 0, index, names[noun], names[owner]))

    def take(self) -> tuple[tuple[str, ...], bytes]:
        """Names and packed entries since the last call."""
        packed = b"".join(self._rows)
        self._rows.clear()
        return tuple(self._names), packed


class NoJournal(JournalWriter):
    """Keeps nothing: for runs that nobody records, such as campaigns."""

    is_kept = False

    def note(
        self,
        kind: Kind,
        node: str | None,
        noun: str,
        owner: str,
        sequence: int,
        now_ns: int,
        wall_ns: int = 0,
    ) -> None:
        """Forget."""


def packed_entries(journal: Journal) -> NDArray[np.void]:
    """Entries as they are packed, shape (n,), dtype ``ENTRY``."""
    return np.frombuffer(journal.entries, dtype=ENTRY)


def read_entries(journal: Journal) -> Iterator[Entry]:
    """Entries of one payload, in order."""
    names = journal.names
    for now_ns, sequence, wall_ns, kind, _, node, noun, owner in packed_entries(journal).tolist():
        key = "" if node == NO_NODE else names[node]
        yield Entry(now_ns, kind, key, names[noun], names[owner], sequence, wall_ns)
