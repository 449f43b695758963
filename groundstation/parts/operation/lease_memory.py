"""The lease on disk, so that it outlives the process that granted it; virtual time has no such port."""

import json
from dataclasses import dataclass
from typing import ClassVar

from groundstation.declarations.kept_file import MemoryEdge, file_at
from groundstation.declarations.lease import LONGEST_S, Lease
from groundstation.declarations.message import Message
from groundstation.declarations.port import Edge, Port
from groundstation.parts.operation.messages import KeptLease

FILE = "control lease"
"""No name of a vehicle, whose rulings are kept beside it."""


def text_of(lease: Lease) -> str:
    """What is kept of a lease."""
    return json.dumps(
        {
            "stamp_ns": lease.stamp_ns,
            "holder": lease.holder,
            "expires_ns": lease.expires_ns,
            "reason": lease.reason,
        }
    )


def lease_of(kept: KeptLease) -> Lease:
    """The lease that was kept; nobody's where there is none of now that can be read.

    The monotonic clock begins again with the host: stamps from before are then ahead, or ends too far off.
    """
    nobodys = Lease(kept.stamp_ns, "", "", 0, "")
    try:
        given = json.loads(kept.content)
        lease = Lease(
            int(given["stamp_ns"]), "", str(given["holder"]), int(given["expires_ns"]), str(given["reason"])
        )
    except (ValueError, KeyError, TypeError, RecursionError, OverflowError):
        return nobodys
    is_of_now = 0 <= lease.stamp_ns <= kept.stamp_ns
    is_possible = lease.expires_ns - kept.stamp_ns <= LONGEST_S * 1e9
    return lease if is_of_now and is_possible else nobodys


@dataclass(frozen=True)
class LeasePort(Port):
    """The lease as it was kept, and the present one, to be kept; delivered before anything else."""

    reads = KeptLease
    is_first: ClassVar[bool] = True

    def to_message(self, stamp_ns: int, data: object) -> Message:
        assert isinstance(data, tuple)
        content, _ = data
        return KeptLease(stamp_ns, "", content)

    def writes(self) -> tuple[tuple[type[Message], str], ...]:
        return ((Lease, ""),)

    def to_device(self, payload: Message) -> object:
        assert isinstance(payload, Lease)
        return text_of(payload)

    def open(self) -> Edge:
        return MemoryEdge(file_at(self.address, FILE), is_expected=False)
