"""Legacy frame, v1: sync byte, sequence, three fixed-point numbers, 8-bit sum. Nine bytes, big endian.

::

    A5 | sequence u8 | gyro u16 /16 | tilt difference x i16 /16 | tilt difference y i16 /16 | sum u8

An 8-bit sum lets 6 % of double bit flips and all swapped bytes pass, so the host adds what the frame lacks:
three consecutive frames before the first is believed, sequence bookkeeping against the bytes that passed,
limits of what the sensors can give.
"""

import math
import struct
from collections import deque

from drivers.imu_block.block_frames import FIXED_POINT, GYRO_CODE_MAX, TILT_CODE_MAX, ImuFrame
from drivers.imu_block.counters import ParserCounters
from drivers.imu_block.step_limit import GYRO_STEP_COUNTS, StepLimit

SYNC = 0xA5
V1_WIRE_BYTES = 9
FRAMES_TO_LOCK = 3
REPEATS_KNOWN = 8
"""Of the last so many frames, one that comes again is known."""
FIRST_SEQUENCES = 3
"""A stream that goes on with one of these, without the bytes of what is missing, has begun again,"""
SMALL_GAP = 16
"""unless it is so little."""

_SYNC_BYTES = bytes((SYNC,))
_LAYOUT = struct.Struct(">BBHhhB")
_BODY = struct.Struct(">BBHhh")
_UNLOCK_AFTER_BYTES = FRAMES_TO_LOCK * V1_WIRE_BYTES
_GYRO_FIXED_MAX = GYRO_CODE_MAX * FIXED_POINT
_DIFFERENCE_FIXED_MAX = TILT_CODE_MAX * FIXED_POINT


def to_fixed(counts: float, lowest: float, highest: float, what: str) -> int:
    """Round counts to sixteenths (half up, as the firmware does).

    Raises:
        ValueError: if the value is not between ``lowest`` and ``highest``.
    """
    if not lowest <= counts <= highest:
        raise ValueError(f"{what} is {counts} counts, expected {lowest} to {highest}")
    return math.floor(counts * FIXED_POINT + 0.5)


def encode_v1(*, sequence: int, gyro_counts: float, tilt_difference_counts: tuple[float, float]) -> bytes:
    """Build one v1 frame (9 bytes).

    Args:
        sequence: frame counter, taken modulo 256.
        gyro_counts: mean gyro code, 0..4095.
        tilt_difference_counts: mean X - Y of chip x and chip y, each -2047..2047.

    Raises:
        ValueError: if a value is out of range.
    """
    x, y = tilt_difference_counts
    body = _BODY.pack(
        SYNC,
        sequence & 0xFF,
        to_fixed(gyro_counts, 0, GYRO_CODE_MAX, "gyro"),
        to_fixed(x, -TILT_CODE_MAX, TILT_CODE_MAX, "tilt difference x"),
        to_fixed(y, -TILT_CODE_MAX, TILT_CODE_MAX, "tilt difference y"),
    )
    return body + bytes((sum(body) & 0xFF,))


class V1Parser:
    """Cuts v1 frames out of a byte stream that may start or break anywhere.

    Args:
        counters: where to count; shared with the owner.
        sample_count: polls averaged per frame, a setting of the block that v1 does not transmit.
    """

    def __init__(self, counters: ParserCounters, sample_count: int) -> None:
        self.counters = counters
        self.is_locked = False
        self.lock_end_offset: int | None = None
        """Index, in the last chunk, of the byte that won the first lock of that chunk."""
        self._sample_count = sample_count
        self._buffer = b""
        self._last_sequence: int | None = None
        self._steps = StepLimit(GYRO_STEP_COUNTS * FIXED_POINT)
        self._recent: deque[bytes] = deque(maxlen=REPEATS_KNOWN)
        self._skipped_bytes = 0

    def begun_again(self, counters: ParserCounters) -> "V1Parser":
        """A parser that knows nothing of the stream but what the last frame of this one was."""
        parser = V1Parser(counters, self._sample_count)
        parser._last_sequence = self._last_sequence
        parser._skipped_bytes = self._skipped_bytes + len(self._buffer)
        return parser

    def adopt(self, counters: ParserCounters) -> None:
        """Count into ``counters`` from now on."""
        self.counters = counters

    def feed(self, chunk: bytes) -> list[ImuFrame]:
        """Return every frame that the stream so far completes."""
        data = self._buffer + chunk if self._buffer else chunk
        origin = len(self._buffer)
        frames: list[ImuFrame] = []
        self.lock_end_offset = None
        position = 0
        while position < len(data):
            if data[position] != SYNC:
                found = data.find(_SYNC_BYTES, position)
                found = len(data) if found < 0 else found
                if not self._skipped_bytes:
                    self.counters.rejected_sync += 1
                self._skip(found - position)
                position = found
                continue
            if len(data) - position < V1_WIRE_BYTES:
                break
            if self.is_locked:
                taken = self._take_locked(data, position, origin, frames)
            else:
                taken = self._take_unlocked(data, position, origin, frames)
            if taken is None:
                break
            position += taken
        self._buffer = data[position:]
        return frames

    def _skip(self, count: int) -> None:
        self._skipped_bytes += count
        self.counters.bytes_rejected += count
        if self._skipped_bytes >= _UNLOCK_AFTER_BYTES:
            self.is_locked = False

    def _read(self, data: bytes, position: int) -> tuple[int, int, int, int] | None:
        """Return (sequence, gyro, x, y) in fixed point of the candidate, None (counted) if it is none."""
        _, sequence, gyro, x, y, check = _LAYOUT.unpack_from(data, position)
        if sum(data[position : position + V1_WIRE_BYTES - 1]) & 0xFF != check:
            self.counters.rejected_checksum += 1
            return None
        limit = _DIFFERENCE_FIXED_MAX
        if gyro > _GYRO_FIXED_MAX or not -limit <= x <= limit or not -limit <= y <= limit:
            self.counters.rejected_implausible += 1
            return None
        return sequence, gyro, x, y

    def _take_locked(self, data: bytes, position: int, origin: int, frames: list[ImuFrame]) -> int | None:
        fields = self._read(data, position)
        if fields is None:
            self._skip(1)
            return 1
        frame = data[position : position + V1_WIRE_BYTES]
        if frame in self._recent:  # something on the way has sent it twice
            self.counters.rejected_sequence += 1
            self.counters.bytes_rejected += V1_WIRE_BYTES
            return V1_WIRE_BYTES
        sequence, gyro, _, _ = fields
        assert self._last_sequence is not None
        missing = (sequence - self._last_sequence - 1) & 0xFF
        # Missing frames must have left their bytes, whole or mutilated, in the stream.
        is_explained = missing == 0 or (missing - 1) * V1_WIRE_BYTES < self._skipped_bytes
        is_explained &= self._skipped_bytes <= (missing or 1) * V1_WIRE_BYTES
        if not is_explained:
            self.counters.rejected_sequence += 1
            self.is_locked = False
            return 0
        self.counters.frames_lost += missing
        self._remember(sequence, frame)
        if self._steps.is_step(gyro):
            self.counters.rejected_step += 1
            self.counters.bytes_rejected += V1_WIRE_BYTES
        else:
            frames.append(self._frame(fields, position + V1_WIRE_BYTES - 1 - origin))
        return V1_WIRE_BYTES

    def _take_unlocked(self, data: bytes, position: int, origin: int, frames: list[ImuFrame]) -> int | None:
        """Believe nothing until three frames stand in a row; then hand out all three."""
        candidates: list[tuple[int, int, int, int]] = []
        for index in range(FRAMES_TO_LOCK):
            start = position + index * V1_WIRE_BYTES
            if start + V1_WIRE_BYTES > len(data):
                # Not counted twice: a later call looks at the same candidates again.
                return None
            fields = self._peek(data, start, candidates)
            if fields is None:
                self._skip(1)
                return 1
            candidates.append(fields)
        self._account_for_gap(candidates[0][0])
        self._steps = StepLimit(GYRO_STEP_COUNTS * FIXED_POINT)
        for index, fields in enumerate(candidates):
            start = position + index * V1_WIRE_BYTES
            frames.append(self._frame(fields, start + V1_WIRE_BYTES - 1 - origin))
            self._steps.is_step(fields[1])
            self._remember(fields[0], data[start : start + V1_WIRE_BYTES])
        self.is_locked = True
        self.counters.locks += 1
        if self.lock_end_offset is None:
            self.lock_end_offset = frames[-1].end_offset
        return FRAMES_TO_LOCK * V1_WIRE_BYTES

    def _account_for_gap(self, sequence: int) -> None:
        """Count what is missing before a new lock: by sequence, and by the bytes that passed beyond 256."""
        if self._last_sequence is None:
            return
        missing = (sequence - self._last_sequence - 1) & 0xFF
        passed = self._skipped_bytes / V1_WIRE_BYTES
        if sequence <= FIRST_SEQUENCES and missing > SMALL_GAP and passed < missing / 2:
            self.counters.discontinuities += 1
            return
        missing += 256 * max(0, round((passed - missing) / 256))
        self.counters.frames_lost += missing
        self.counters.discontinuities += missing > 0

    def _peek(
        self, data: bytes, start: int, before: list[tuple[int, int, int, int]]
    ) -> tuple[int, int, int, int] | None:
        if data[start] != SYNC:
            self.counters.rejected_sync += 1
            return None
        fields = self._read(data, start)
        if fields is None or not before:
            return fields
        if (fields[0] - before[-1][0]) & 0xFF != 1:
            self.counters.rejected_sequence += 1
            return None
        if abs(fields[1] - before[-1][1]) > GYRO_STEP_COUNTS * FIXED_POINT:
            self.counters.rejected_step += 1
            return None
        return fields

    def _remember(self, sequence: int, frame: bytes) -> None:
        self._last_sequence = sequence
        self._recent.append(frame)
        self._skipped_bytes = 0

    def _frame(self, fields: tuple[int, int, int, int], end_offset: int) -> ImuFrame:
        sequence, gyro, x, y = fields
        self.counters.frames_good += 1
        return ImuFrame(
            version=1,
            sequence=sequence,
            tick_ms=None,
            sample_count=self._sample_count,
            gyro_counts=gyro / FIXED_POINT,
            tilt_counts=None,
            tilt_difference_counts=(x / FIXED_POINT, y / FIXED_POINT),
            housekeeping=None,
            attention=False,
            end_offset=end_offset,
        )
