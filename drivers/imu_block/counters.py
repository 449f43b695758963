"""What a parser counted: good frames, lost frames, and every rejected byte's reason."""

from dataclasses import dataclass, fields


@dataclass(slots=True)
class ParserCounters:
    """Running counts of one byte stream; they only grow, but for ``bytes_undetected``.

    Attributes:
        bytes_seen: all bytes fed.
        bytes_rejected: bytes that belong to no accepted frame or reply.
        bytes_undetected: gauge: bytes seen while the frame version is still unknown.
        frames_good: sample frames handed out.
        frames_lost: frames missing by sequence (v1) or tick (v2) gaps.
        replies_good: replies handed out.
        locks: how often a lock on the stream was won (v1: three consecutive frames; v2: first good frame).
        discontinuities: jumps of sequence or tick that loss does not explain (restart of the block).
        rejected_sync: v1: runs of bytes skipped in search of the sync byte.
        rejected_checksum: v1: candidates with a wrong 8-bit sum.
        rejected_sequence: frames that came before; v1: also candidates whose sequence does not follow.
        rejected_implausible: fields no sensor can give (both versions); of v2 also temperatures, without
            which the frame is good.
        rejected_step: v1: gyro jump from frame to frame beyond the limit.
        rejected_length: v2: packet of a length that no type has.
        rejected_cobs: v2: broken byte stuffing.
        rejected_crc: v2: wrong CRC.
        rejected_type: v2: good CRC, unknown type.
    """

    bytes_seen: int = 0
    bytes_rejected: int = 0
    bytes_undetected: int = 0
    frames_good: int = 0
    frames_lost: int = 0
    replies_good: int = 0
    locks: int = 0
    discontinuities: int = 0
    rejected_sync: int = 0
    rejected_checksum: int = 0
    rejected_sequence: int = 0
    rejected_implausible: int = 0
    rejected_step: int = 0
    rejected_length: int = 0
    rejected_cobs: int = 0
    rejected_crc: int = 0
    rejected_type: int = 0

    def add(self, other: "ParserCounters") -> None:
        """Add every count of ``other`` to this one."""
        for field in fields(self):
            setattr(self, field.name, getattr(self, field.name) + getattr(other, field.name))

    def as_dict(self) -> dict[str, int]:
        """Return the counts by name, in the order of the table above."""
        return {field.name: getattr(self, field.name) for field in fields(self)}
