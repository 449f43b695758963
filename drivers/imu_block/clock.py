"""Microcontroller ticks to host time: when did each averaging window end on the host's monotonic clock?

The block's 1 kHz ticks are even, the arrival of its bytes is not. Every read gives an upper bound on the
offset between the two clocks: its last byte was sent before it arrived. Where in which frame that byte sits
is known once the frame is complete, and so is the moment it left the block (tick + send delay + bytes x byte
time).
The lower envelope of the bounds is the offset (``lower_envelope``).

What no host can see is a delay that every packet has in common. An FTDI chip that waits for its latency timer
delays each packet's last byte by at most the timer and at most the longest pause on the line; half of that is
subtracted and the standard deviation of the uniform rest stated. The remaining constant is part of what the
camera-delay calibration finds.
"""

import math
from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

from drivers.imu_block.block_frames import TICK_NS, ImuFrame
from drivers.imu_block.frame_v1 import V1_WIRE_BYTES
from drivers.imu_block.frame_v2 import V2_WIRE_BYTES
from drivers.imu_block.lower_envelope import BLOCK_NS, DRIFT_LIMIT, LowerEnvelope

FTDI_PACKET_BYTES = 62
FTDI_LATENCY_TIMER_S = 0.016
SEND_DELAY_S = 0.0005
SEND_DELAY_STD_S = 0.0001
SLEW_LIMIT = 500e-6
LOCK_AFTER_BLOCKS = 3
LOCK_AFTER_POINTS = 20

_UNLOCKED_SLEW_LIMIT = 0.5
_FUTURE_NS = 20e6
"""A tick this far ahead of its arrival is another epoch's: bytes do not travel back in time."""
_LATE_NS = 150e6
"""A tick that jumped and is this late belongs to a restarted block, not to a slow host."""
_LOST_NS = 50e6
_READS_KEPT = 64
FIRST_JITTER_NS = 3e6
"""Host delay assumed before any is known."""


class TickStamp(NamedTuple):
    """When a frame's averaging window ended.

    Attributes:
        stamp_ns: host monotonic time of the window's end; strictly increasing from frame to frame.
        stamp_sigma_s: standard deviation of the stamp, the common delay of all packets included.
        tick: tick of the window's end since the block started, unwrapped.
        elapsed_ticks: ticks since the previous frame, None where the block (re)started. Integrate with these.
        epoch: +1 at each restart of the block.
    """

    stamp_ns: int
    stamp_sigma_s: float
    tick: int
    elapsed_ticks: int | None
    epoch: int


class TickClock:
    """Stamps frames; give it every read, in order, whether or not it completed a frame.

    Args:
        baud: nominal bit rate of the line, bit/s.
        latency_timer_s: longest time the link holds back a byte that waits (FTDI: 0.016 or as set; 0 for a
            link without such a timer).
        send_delay_s: from the edge of a frame's tick to the start of its first byte.

    Raises:
        ValueError: if the bit rate is not positive or the timer is negative.
    """

    def __init__(
        self,
        baud: int,
        *,
        latency_timer_s: float = FTDI_LATENCY_TIMER_S,
        send_delay_s: float = SEND_DELAY_S,
    ) -> None:
        if baud <= 0 or latency_timer_s < 0:
            raise ValueError(f"bit rate {baud} and latency timer {latency_timer_s} s must be positive")
        self.epoch = 0
        self._byte_ns = 10e9 / baud
        self._timer_ns = latency_timer_s * 1e9
        self._send_delay_ns = send_delay_s * 1e9
        self._bytes_read = 0
        self._reads: deque[tuple[int, int]] = deque(maxlen=_READS_KEPT)
        self._origin_ns = 0
        self._envelope = LowerEnvelope()
        self._is_started = False
        self._tick = 0
        self._raw_tick = 0
        self._taught: list[tuple[int, int | None]] = []
        self._stamps: list[TickStamp] = []
        self._last_stamp_ns: int | None = None
        self._shape = (0, 0)
        self._common_delay_ns = 0.0

    @property
    def is_locked(self) -> bool:
        """Whether stamps now follow the line by slewing only."""
        envelope = self._envelope
        return envelope.blocks_closed >= LOCK_AFTER_BLOCKS and envelope.points_seen >= LOCK_AFTER_POINTS

    @property
    def drift_ratio(self) -> float:
        """Host time per block time minus one; positive when the block's clock is slow."""
        return self._envelope.drift

    def update(self, arrival_ns: int, chunk_bytes: int, frames: Sequence[ImuFrame]) -> list[TickStamp]:
        """Stamp the frames that one read completed.

        Args:
            arrival_ns: host monotonic time right after the read returned.
            chunk_bytes: size of the read.
            frames: what the parser made of it, in order; replies left out.
        """
        start = self._bytes_read
        self._bytes_read += chunk_bytes
        if chunk_bytes:
            self._reads.append((self._bytes_read - 1, arrival_ns))
        # A read after a pause holds old frames and new: all teach before the first is stamped.
        self._stamps = []
        last = frames[-1] if frames else None
        for frame in frames:
            end = start + frame.end_offset
            size = V1_WIRE_BYTES if frame.version == 1 else V2_WIRE_BYTES
            if self._shape != (size, frame.sample_count):
                self._shape = (size, frame.sample_count)
                self._common_delay_ns = self._longest_common_delay_ns()
            latest_end_ns = arrival_ns - (self._bytes_read - 1 - end) * self._byte_ns
            elapsed = self._unwrap(frame, latest_end_ns - self._send_delay_ns - size * self._byte_ns)
            self._learn(end, size, latest_end_ns, frame is last)
            self._taught.append((self._tick, elapsed))
        self._stamp_taught()
        return self._stamps

    def _stamp_taught(self) -> None:
        self._stamps += [self._slewed(tick, elapsed) for tick, elapsed in self._taught]
        self._taught = []

    def _unwrap(self, frame: ImuFrame, latest_edge_ns: float) -> int | None:
        """Advance the unwrapped tick; return the ticks since the last frame, None at a new epoch."""
        if frame.tick_ms is not None:
            raw, modulus = frame.tick_ms, 65536
        else:
            raw, modulus = (frame.sequence or 0) * frame.sample_count, 256 * frame.sample_count
        if not self._is_started:
            self._start(raw, latest_edge_ns)
            return None
        elapsed = (raw - self._raw_tick) % modulus
        if elapsed != frame.sample_count:
            late_ns = self._lateness_ns(self._tick + elapsed, latest_edge_ns)
            wraps = math.floor((late_ns + _FUTURE_NS) / (modulus * TICK_NS))
            if wraps > 0:
                elapsed += wraps * modulus
                late_ns -= wraps * modulus * TICK_NS
            if elapsed == 0 or not -_FUTURE_NS <= late_ns <= _LATE_NS:
                self._restart(raw, latest_edge_ns)
                return None
        elif self._envelope.floor_of_last_blocks_ns() > _LOST_NS:
            self._restart(raw, latest_edge_ns)
            return None
        self._tick += elapsed
        self._raw_tick = raw
        return elapsed

    def _lateness_ns(self, tick: int, latest_edge_ns: float) -> float:
        device_ns = float(tick * TICK_NS)
        return latest_edge_ns - self._origin_ns - device_ns - self._envelope.height_ns(device_ns)

    def _start(self, raw: int, latest_edge_ns: float) -> None:
        self._is_started = True
        self._tick = self._raw_tick = raw
        self._origin_ns = round(latest_edge_ns) - raw * TICK_NS

    def _restart(self, raw: int, latest_edge_ns: float) -> None:
        self._stamp_taught()
        self.epoch += 1
        self._envelope = LowerEnvelope()
        self._start(raw, latest_edge_ns)

    def _learn(self, end: int, size: int, latest_end_ns: float, is_last: bool) -> None:
        """Give the envelope each read that ended within this frame, and the last frame's own bound."""
        device_ns = float(self._tick * TICK_NS)
        departure_ns = self._origin_ns + device_ns + self._send_delay_ns
        reads = self._reads
        while reads and reads[0][0] <= end:
            last_byte, arrival_ns = reads.popleft()
            sent = last_byte - (end - size)
            if sent > 0:
                self._envelope.add(device_ns, arrival_ns - departure_ns - sent * self._byte_ns)
        if is_last and end < self._bytes_read - 1:
            self._envelope.add(device_ns, latest_end_ns - departure_ns - size * self._byte_ns)

    def _slewed(self, tick: int, elapsed: int | None) -> TickStamp:
        """Move the stamp towards the line no faster than allowed; say how sure it is."""
        device_ns = float(tick * TICK_NS)
        line_ns = self._envelope.height_ns(device_ns) - self._common_delay_ns / 2
        wanted_ns = self._origin_ns + round(device_ns + line_ns)
        stamp_ns = wanted_ns
        if self._last_stamp_ns is not None:
            nominal_ns = (elapsed or 0) * TICK_NS
            limit = SLEW_LIMIT if self.is_locked else _UNLOCKED_SLEW_LIMIT
            earliest = self._last_stamp_ns + max(1, math.ceil(nominal_ns * (1 - limit)))
            stamp_ns = max(wanted_ns, earliest)
            if self.is_locked and elapsed is not None:
                stamp_ns = min(stamp_ns, self._last_stamp_ns + math.floor(nominal_ns * (1 + limit)))
        self._last_stamp_ns = stamp_ns
        return TickStamp(stamp_ns, self._sigma_s(stamp_ns - wanted_ns), tick, elapsed, self.epoch)

    def _sigma_s(self, lag_ns: int) -> float:
        envelope = self._envelope
        first_guess_ns = max(self._timer_ns, 1e6) + FIRST_JITTER_NS
        line_ns = max(envelope.scatter_ns, 20e3) + 2 * first_guess_ns / (envelope.points_seen + 1)
        line_ns += 2 * DRIFT_LIMIT * BLOCK_NS / (envelope.blocks_closed + 1)
        variance_ns2 = self._common_delay_ns**2 / 12 + (SEND_DELAY_STD_S * 1e9) ** 2 + line_ns**2
        return (math.sqrt(variance_ns2) + abs(lag_ns)) * 1e-9

    def _longest_common_delay_ns(self) -> float:
        """Return how long the last byte of every packet may have waited in the link."""
        size, sample_count = self._shape
        period_ns = sample_count * TICK_NS
        if size * self._timer_ns > 1.05 * FTDI_PACKET_BYTES * period_ns:
            return 0.0  # packets leave full, with their last byte
        pause_ns = max(0.0, period_ns - size * self._byte_ns)
        return min(self._timer_ns, pause_ns)
