r"""Wire format of the reference stream: poses to bytes and back, pure.

One frame per pose, little endian (`docs/interfaces/reference_stream.md`):

    B5 'R' | kind u8 | length u8 | payload | CRC-32 of kind, length and payload

A receiver that finds a wrong check looks for the next sync one byte further on, not behind the frame's
end, so that noise costs no frame but the one it hit.
"""

import math
import struct
import zlib
from dataclasses import dataclass

from drivers.reference.messages import ReferencePose

__all__ = ["FRAME_SIZE", "PoseParser", "ReferencePose", "StreamCounters", "encode"]

SYNC = b"\xb5R"
KIND_POSE = 1
_POSE = struct.Struct("<BBHqI6d6f")  # vehicle, flags, sequence, stamp, age, pose and velocity, covariance
_CHECK = struct.Struct("<I")
_HEADER = SYNC + bytes((KIND_POSE, _POSE.size))
_CHECKED_FROM = len(SYNC)
FRAME_SIZE = len(_HEADER) + _POSE.size + _CHECK.size

_FLAG_TRACKED = 1
_FLAG_HOST_CLOCK = 2
_SEQUENCE_MODULUS = 1 << 16
_MAX_AGE_NS = (1 << 32) - 1


@dataclass(slots=True)
class StreamCounters:
    """What a parser has seen since it began."""

    bytes_seen: int = 0
    bytes_skipped: int = 0
    """Bytes that belong to no good frame."""
    frames_good: int = 0
    frames_corrupt: int = 0
    """Headers whose check was wrong."""
    frames_implausible: int = 0
    """Checked frames whose tracked pose or covariance is not finite."""
    frames_lost: int = 0
    """By the gaps in each vehicle's sequence."""


def encode(pose: ReferencePose) -> bytes:
    """The frame of a pose, `FRAME_SIZE` bytes.

    Raises:
        ValueError: A field does not fit its bits.
    """
    if not 0 <= pose.age_ns <= _MAX_AGE_NS:
        raise ValueError(f"age {pose.age_ns} ns is outside 0..{_MAX_AGE_NS}")
    flags = pose.is_tracked * _FLAG_TRACKED | pose.is_host_clock * _FLAG_HOST_CLOCK
    try:
        payload = _POSE.pack(
            pose.vehicle,
            flags,
            pose.sequence,
            pose.stamp_source_ns,
            pose.age_ns,
            *pose.position_table_m,
            pose.heading_rad,
            *pose.velocity_table_m_s,
            pose.rate_rad_s,
            *pose.pose_covariance,
        )
    except (struct.error, OverflowError) as error:
        raise ValueError(f"a pose does not fit its frame: {error}") from error
    frame = _HEADER + payload
    return frame + _CHECK.pack(zlib.crc32(frame[_CHECKED_FROM:]))


class PoseParser:
    """Cuts poses out of a byte stream that may start or break anywhere; never raises on noise."""

    def __init__(self) -> None:
        self.counters = StreamCounters()
        self._buffer = bytearray()
        self._last_sequence: dict[int, int] = {}

    def feed(self, chunk: bytes) -> list[ReferencePose]:
        """Every pose that the stream so far completes, in order."""
        buffer, counters = self._buffer, self.counters
        counters.bytes_seen += len(chunk)
        buffer += chunk
        poses = []
        position = 0
        while (start := buffer.find(_HEADER, position)) >= 0 and len(buffer) - start >= FRAME_SIZE:
            counters.bytes_skipped += start - position
            check_at = start + FRAME_SIZE - _CHECK.size
            if (
                zlib.crc32(buffer[start + _CHECKED_FROM : check_at])
                != _CHECK.unpack_from(buffer, check_at)[0]
            ):
                counters.frames_corrupt += 1
                counters.bytes_skipped += 1
                position = start + 1
                continue
            position = start + FRAME_SIZE
            pose = self._pose(buffer, start + len(_HEADER))
            if pose is not None:
                poses.append(pose)
        keep_from = start if start >= 0 else max(position, len(buffer) - _partial_header(buffer))
        counters.bytes_skipped += keep_from - position
        del buffer[:keep_from]
        return poses

    def _pose(self, buffer: bytearray, offset: int) -> ReferencePose | None:
        vehicle, flags, sequence, stamp_ns, age_ns, *numbers = _POSE.unpack_from(buffer, offset)
        x_m, y_m, heading_rad, vx_m_s, vy_m_s, rate_rad_s, *covariance = numbers
        self._count_gap(vehicle, sequence)
        is_tracked = bool(flags & _FLAG_TRACKED)
        if is_tracked and not all(map(math.isfinite, (x_m, y_m, heading_rad, *covariance))):
            self.counters.frames_implausible += 1
            return None
        self.counters.frames_good += 1
        return ReferencePose(
            vehicle=vehicle,
            sequence=sequence,
            stamp_source_ns=stamp_ns,
            age_ns=age_ns,
            position_table_m=(x_m, y_m),
            heading_rad=heading_rad,
            velocity_table_m_s=(vx_m_s, vy_m_s),
            rate_rad_s=rate_rad_s,
            pose_covariance=tuple(covariance),
            is_host_clock=bool(flags & _FLAG_HOST_CLOCK),
            is_tracked=is_tracked,
        )

    def _count_gap(self, vehicle: int, sequence: int) -> None:
        last = self._last_sequence.get(vehicle)
        self._last_sequence[vehicle] = sequence
        if last is None:
            return
        gap = (sequence - last - 1) % _SEQUENCE_MODULUS
        if gap < _SEQUENCE_MODULUS // 2:  # else the source began again or repeated itself
            self.counters.frames_lost += gap


def _partial_header(buffer: bytearray) -> int:
    """Length of the longest end of the buffer that may grow into a header."""
    for length in range(min(len(_HEADER) - 1, len(buffer)), 0, -1):
        if _HEADER.startswith(buffer[-length:]):
            return length
    return 0
