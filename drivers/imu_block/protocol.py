"""Wire format of the IMU block, both versions: bytes to frames and back, pure.

The byte tables are in ``docs/interfaces/imu_block.md``. This module finds out which version a stream speaks
and re-exports everything that drivers and emulator need.
"""

from drivers.imu_block.block_commands import (
    BadCommand,
    Command,
    CommandParser,
    Identify,
    Ping,
    Reset,
    SelfTest,
    SelfTestChannel,
    SetAveraging,
    encode_identify,
    encode_ping,
    encode_reset,
    encode_self_test,
    encode_set_averaging,
)
from drivers.imu_block.block_frames import (
    TICK_NS,
    Ack,
    AckResult,
    Housekeeping,
    HousekeepingItem,
    Identity,
    ImuFrame,
    Pong,
    Reply,
    Status,
)
from drivers.imu_block.counters import ParserCounters
from drivers.imu_block.frame_v1 import V1_WIRE_BYTES, V1Parser, encode_v1
from drivers.imu_block.frame_v2 import V2_WIRE_BYTES, V2Parser, encode_reply, encode_v2

__all__ = [
    "TICK_NS",
    "V1_WIRE_BYTES",
    "V2_WIRE_BYTES",
    "Ack",
    "AckResult",
    "BadCommand",
    "Command",
    "CommandParser",
    "FrameParser",
    "Housekeeping",
    "HousekeepingItem",
    "Identify",
    "Identity",
    "ImuFrame",
    "ParserCounters",
    "Ping",
    "Pong",
    "Reply",
    "Reset",
    "SelfTest",
    "SelfTestChannel",
    "SetAveraging",
    "Status",
    "encode_identify",
    "encode_ping",
    "encode_reply",
    "encode_reset",
    "encode_self_test",
    "encode_set_averaging",
    "encode_v1",
    "encode_v2",
]

DEFAULT_V1_SAMPLE_COUNT = 8
_SILENCE_BYTES = 1024
"""Bytes without a good frame after which an auto-detecting parser doubts the version."""
_DETECTION_SLICE_BYTES = 256


class FrameParser:
    """Cuts frames and replies out of a byte stream that may start, break or change version anywhere.

    The results do not depend on how the stream is cut into chunks. Noise is counted, never raised.

    Args:
        version: 1 or 2, or None to find out (and to find out again after 1024 bytes without a good frame).
        v1_sample_count: polls per frame of a v1 block, which does not transmit it.

    Raises:
        ValueError: if ``version`` is none of these.

    Attributes:
        detected_version: 1, 2, or None while unknown.
    """

    def __init__(self, version: int | None = None, *, v1_sample_count: int = DEFAULT_V1_SAMPLE_COUNT) -> None:
        if version not in (None, 1, 2):
            raise ValueError(f"IMU block frame version is {version!r}, expected 1, 2 or None")
        self.counters = ParserCounters()
        self.detected_version = version
        self._is_fixed = version is not None
        self._v1_sample_count = v1_sample_count
        self._bytes_since_good = 0
        self._v1 = V1Parser(self.counters, v1_sample_count)
        self._v2 = V2Parser(self.counters)
        if version is None:
            self._start_detection()

    def feed(self, chunk: bytes) -> list[ImuFrame | Reply]:
        """Return every frame and reply that the stream so far completes, in order."""
        self.counters.bytes_seen += len(chunk)
        if self._is_fixed:
            return self._feed_detected(chunk)
        if self.detected_version and len(chunk) <= _SILENCE_BYTES - self._bytes_since_good:
            results = self._feed_detected(chunk)
            self._mark(results, len(chunk))
            return results
        return self._feed_in_slices(chunk)

    def _feed_detected(self, chunk: bytes) -> list[ImuFrame | Reply]:
        if self.detected_version == 2:
            return self._v2.feed(chunk)
        return list(self._v1.feed(chunk))

    def _feed_in_slices(self, chunk: bytes) -> list[ImuFrame | Reply]:
        """Feed so that every decision falls on the same byte whatever the chunks are."""
        results: list[ImuFrame | Reply] = []
        start = 0
        while start < len(chunk):
            size = _DETECTION_SLICE_BYTES
            if self.detected_version:
                size = _SILENCE_BYTES - self._bytes_since_good
            piece = chunk[start : start + size]
            found = self._feed_detected(piece) if self.detected_version else self._detect(piece)
            self._mark(found, len(piece))
            if start:
                found = [_moved(result, start) for result in found]
            results += found
            start += len(piece)
        return results

    def _mark(self, results: list[ImuFrame | Reply], size: int) -> None:
        """Note where the last good frame ended; go back to detection after too long without one."""
        if not self.detected_version:
            return
        self._bytes_since_good += size
        for result in reversed(results):
            if isinstance(result, ImuFrame):
                self._bytes_since_good = size - 1 - result.end_offset
                break
        if self._bytes_since_good >= _SILENCE_BYTES:
            self._start_detection()

    def _start_detection(self) -> None:
        self.detected_version = None
        self._v1 = self._v1.begun_again(ParserCounters())
        self._v2 = self._v2.begun_again(ParserCounters())
        self.counters.bytes_undetected = 0

    def _detect(self, piece: bytes) -> list[ImuFrame | Reply]:
        """Let both versions try; the one that is sure at the earlier byte has the stream."""
        first, second = self._v1.feed(piece), self._v2.feed(piece)
        v1_sure, v2_sure = self._v1.lock_end_offset, self._v2.lock_end_offset
        if v1_sure is None and v2_sure is None:
            self.counters.bytes_undetected += len(piece)
            return []
        is_v1 = v2_sure is None or (v1_sure is not None and v1_sure < v2_sure)
        winner: V1Parser | V2Parser = self._v1 if is_v1 else self._v2
        sure_at = v1_sure if is_v1 else v2_sure
        assert sure_at is not None
        self.detected_version = 1 if is_v1 else 2
        self._bytes_since_good = -1 - sure_at  # the caller adds the whole piece
        self.counters.bytes_undetected = 0
        self.counters.add(winner.counters)
        winner.adopt(self.counters)
        return list(first) if is_v1 else second


def _moved(result: ImuFrame | Reply, by: int) -> ImuFrame | Reply:
    """Return ``result`` with its end offset counted from the start of the whole chunk."""
    if not isinstance(result, ImuFrame):
        return result
    return result._replace(end_offset=result.end_offset + by)
