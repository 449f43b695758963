"""The journal: what each node consumed and said, in the order only its runner knows.

Replay follows it. A process packs entries of fixed size and publishes them as ``Journal`` payloads;
an entry is read against the names (nodes and owners) that stand in the same payload.
"""

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray


class Kind(IntEnum):
    """What happened."""

    START = 0  # topic 0; sequence is a CRC-32 of configuration and calibration
    INPUT = 1  # the node consumed (topic, owner, sequence)
    TICK = 2  # the node was ticked
    OUTPUT = 3  # the node said (topic, owner, sequence)
    DROP = 4  # (topic, owner, sequence) was replaced by a newer one before the node took it
    PORT = 5  # a port of the process turned something outside into (topic, owner, sequence)
    STOP = 6  # the node was told that its process ends


ENTRY = np.dtype(
    [
        ("now_ns", "<i8"),
        ("sequence", "<u4"),
        ("kind", "u1"),
        ("topic", "u1"),
        ("node", "<u2"),  # index in names; 0xFFFF for PORT
        ("owner", "<u2"),  # index in names
        ("_pad", "<u2"),
        ("wall_ns", "<u4"),
    ]
)
NO_NODE = 0xFFFF
_LONGEST_NS = 0xFFFFFFFF


class JournalWriter:
    """Collects the entries of one process between two publications."""

    def __init__(self) -> None:
        self._names: dict[str, int] = {}
        self._rows: list[tuple[int, int, int, int, int, int, int, int]] = []

    def __len__(self) -> int:
        return len(self._rows)

    def note(
        self,
        kind: Kind,
        node: str | None,
        topic: int,
        owner: str,
        sequence: int,
        now_ns: int,
        wall_ns: int = 0,
    ) -> None:
        """Add one entry.

        Args:
            kind: What happened.
            node: Its key, ``name`` or ``vehicle/name``; None for a port.
            topic: Index of the topic's row.
            owner: Vehicle or process of the topic.
            sequence: Of the message.
            now_ns: The moment the node was told.
            wall_ns: Time it took, 0 in lockstep.
        """
        names = self._names
        node_index = NO_NODE if node is None else names.setdefault(node, len(names))
        owner_index = names.setdefault(owner, len(names))
        if wall_ns > _LONGEST_NS:
            wall_ns = _LONGEST_NS
        self._rows.append((now_ns, sequence, kind, topic, node_index, owner_index, 0, wall_ns))

    def take(self) -> tuple[tuple[str, ...], bytes]:
        """Names and packed entries since the last call."""
        packed = np.array(self._rows, dtype=ENTRY).tobytes()
        self._rows.clear()
        return tuple(self._names), packed


class NoJournal(JournalWriter):
    """Keeps nothing: for runs that nobody records, such as campaigns."""

    def note(
        self,
        kind: Kind,
        node: str | None,
        topic: int,
        owner: str,
        sequence: int,
        now_ns: int,
        wall_ns: int = 0,
    ) -> None:
        """Forget."""


def read_entries(data: bytes) -> NDArray[np.void]:
    """Entries of one ``Journal`` payload, shape (n,), dtype ``ENTRY``."""
    return np.frombuffer(data, dtype=ENTRY)
