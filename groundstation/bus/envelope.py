"""What the runner writes on each payload: where it belongs in the order of things, and what it cost.

Whatever a wall clock measured lives here and never in a payload. The envelope travels as the
attachment of the bus message; the latency ledger is made from envelopes.
"""

import struct
from typing import NamedTuple

from groundstation.bus.topics import Topic
from groundstation.messages.base import Message

_HEAD = struct.Struct("<IqIIB")
_CAUSE = struct.Struct("<BI")


class Cause(NamedTuple):
    """One message that a payload was made from: its topic's row and its sequence number."""

    topic_index: int
    sequence: int


class Envelope(NamedTuple):
    """Attributes of one published payload; a named tuple, since thousands are made a second.

    Attributes:
        topic: Row of the topic table.
        vehicle: Owner; the process name for topics of process scope.
        sequence: Counts the publications of one topic of one owner, from 1.
        publish_ns: Host monotonic clock (virtual time in lockstep).
        wall_ns: Wall time the node took over the call that made it, 0 in lockstep.
        cpu_ns: CPU time of that call, 0 in lockstep.
        causes: The triggering message first, then the newest of the node's other inputs.
    """

    topic: Topic
    vehicle: str
    sequence: int
    publish_ns: int
    wall_ns: int = 0
    cpu_ns: int = 0
    causes: tuple[Cause, ...] = ()

    def pack(self) -> bytes:
        """The bus attachment."""
        head = _HEAD.pack(
            self.sequence,
            self.publish_ns,
            min(self.wall_ns, 0xFFFFFFFF),
            min(self.cpu_ns, 0xFFFFFFFF),
            len(self.causes),
        )
        return head + b"".join(_CAUSE.pack(*cause) for cause in self.causes)

    @classmethod
    def unpack(cls, topic: Topic, vehicle: str, data: bytes) -> "Envelope":
        """Read an attachment back; raises ValueError where it is cut off."""
        try:
            sequence, publish_ns, wall_ns, cpu_ns, count = _HEAD.unpack_from(data)
            causes = tuple(
                Cause(*_CAUSE.unpack_from(data, _HEAD.size + i * _CAUSE.size)) for i in range(count)
            )
        except struct.error as error:
            raise ValueError(f"{topic.noun}: attachment of {len(data)} bytes is cut off") from error
        return cls(topic, vehicle, sequence, publish_ns, wall_ns, cpu_ns, causes)


class Delivered(NamedTuple):
    """A payload together with its envelope: what transports and recorders handle."""

    envelope: Envelope
    payload: Message
