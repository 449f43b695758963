"""What the runner writes on each payload: where it belongs in the order of things, and what it cost.

Whatever a wall clock measured lives here and never in a payload. The latency ledger is made from
envelopes, by following triggers. A cause names a thing (noun, owner, sequence), so that no row of a table
has a meaning in a recording. What else a node knew when it published, the journal names.
"""

import struct
from typing import NamedTuple

from groundstation.declarations.message import Message
from groundstation.declarations.topic import Topic

_ATTACHMENT = struct.Struct("<Iq")


class Cause(NamedTuple):
    """One message that a payload was made from."""

    noun: str
    owner: str
    sequence: int


class Envelope(NamedTuple):
    """Attributes of one published payload; a named tuple, since thousands are made a second.

    Attributes:
        topic: Of the payload.
        owner: Vehicle or process, empty for topics of the rig.
        sequence: Counts the publications of one topic of one owner, from 1.
        publish_ns: Host monotonic clock (virtual time in lockstep).
        wall_ns: Wall time the node took over the call that made it, 0 in lockstep.
        trigger: The message that it answers, in a tick the newest of the node's trigger; None where there
            is none.
    """

    topic: Topic
    owner: str
    sequence: int
    publish_ns: int
    wall_ns: int = 0
    trigger: Cause | None = None

    def as_cause(self) -> Cause:
        """What names this message as the cause of another."""
        return Cause(self.topic.noun, self.owner, self.sequence)

    def attachment(self) -> bytes:
        """What travels with the payload on its own key; cost and trigger travel in the record stream."""
        return _ATTACHMENT.pack(self.sequence, self.publish_ns)

    @classmethod
    def of_attachment(cls, topic: Topic, owner: str, data: bytes) -> "Envelope":
        """Read an attachment back.

        Raises:
            ValueError: It is cut off or too long.
        """
        if len(data) != _ATTACHMENT.size:
            raise ValueError(f"{topic.noun}: an attachment of {len(data)} bytes, expected {_ATTACHMENT.size}")
        return cls(topic, owner, *_ATTACHMENT.unpack(data))


class Delivered(NamedTuple):
    """A payload together with its envelope: what transports and recorders handle."""

    envelope: Envelope
    payload: Message
