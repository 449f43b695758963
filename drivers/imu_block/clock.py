"""Microcontroller ticks to host time: when did each averaging window end on the host's monotonic clock?

The block's ticks are even, the arrival of its bytes is not. Every read gives an upper bound on the
offset between the two clocks: its last byte was sent before it arrived. Where in which frame that byte sits
is known once the frame is complete, and so is the moment it left the block (tick + send delay + bytes x byte
time). The lower envelope of the bounds is the offset, and its slope the drift (``lower_envelope``).

What no host can see is a delay that every packet has in common; ``link_wait`` states what it can be. What
remains of it is part of what the camera-delay calibration finds.

A block that starts again shows only in its counter, which may look as if frames were lost. Lost frames
leave the arrivals where they belong; a new beginning does not, but for the chance that both agree.
"""

import math
from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

from drivers.imu_block.block_frames import TICK_NS, ImuFrame
from drivers.imu_block.frame_v1 import V1_WIRE_BYTES
from drivers.imu_block.frame_v2 import V2_WIRE_BYTES
from drivers.imu_block.link_wait import FTDI_PACKET_BYTES, LinkWait
from drivers.imu_block.lower_envelope import SECOND_NS, LowerEnvelope, Point

FTDI_LATENCY_TIMER_S = 0.016
SEND_DELAY_S = 0.0005
SEND_DELAY_STD_S = 0.0001
SLEW_LIMIT = 350e-6
"""Against the line; crystals add their 100 ppm to it, and 50 are left for what is not known yet."""
LOCK_AFTER_NS = 3 * SECOND_NS
LOCK_AFTER_POINTS = 20
FIRST_JITTER_NS = 3e6
"""Host delay assumed before any is known."""

_WITNESS_NS = 20e6
"""Arrivals nearer to each other are late together."""
_UNLOCKED_SLEW_LIMIT = 0.5
_READS_KEPT = 64
_BACKLOG_BYTES = 1024
"""A read of so many bytes emptied a buffer: what it holds is late for a reason that ends with it."""
_EARLY_NS = 1.5e6
"""A tick further ahead of its arrival is another epoch's: bytes do not travel back in time."""
_LATE_NS = 5e6
"""After lost frames, besides what is usual on the link: later, the block has started again."""
_PAUSE_NS = 30e6
_FIRST_TICKS = 4
"""After so long a silence one of the first windows of all is a new beginning, unless its time fits."""
_LASTS_NS = 3 * SECOND_NS
_LASTING_LATE_NS = 10e6
"""Arrivals that are so late for so long are no stall of the host: the block has started again."""
_STALL_NS = 150e6
"""A host that stalls and loses frames at once may have been late by so much."""
_DOUBT_POINTS = 8
_LATEST_NOTED_NS = 30e6


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
        latency_timer_s: longest time the link is said to hold back a byte that waits (FTDI: 0.016 or as set;
            0 for a link without such a timer). What the link itself reports goes to ``measured_timer``.
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
        self._link = LinkWait(latency_timer_s * 1e9)
        self._send_delay_ns = send_delay_s * 1e9
        self._bytes_read = 0
        self._reads: deque[tuple[int, int, int]] = deque(maxlen=_READS_KEPT)
        self._pauses: deque[tuple[int, int]] = deque(maxlen=_READS_KEPT)
        self._read_ns: int | None = None
        self._origin_ns = 0
        self._envelope = LowerEnvelope()
        self._is_started = False
        self._tick = 0
        self._raw_tick = 0
        self._next_departure_ns: float | None = None
        self._usual_late_ns = self._widest_wait_ns = 0.0
        self._late_since_tick: int | None = None
        self._doubt_ns = 0.0
        self._taught: list[tuple[int, int | None]] = []
        self._stamps: list[TickStamp] = []
        self._last_stamp_ns: int | None = None

    @property
    def is_locked(self) -> bool:
        """Whether stamps now follow the line by slewing only."""
        envelope = self._envelope
        return envelope.length_ns >= LOCK_AFTER_NS and envelope.points_seen >= LOCK_AFTER_POINTS

    @property
    def drift_ratio(self) -> float:
        """Host time per block time minus one; positive when the block's clock is slow."""
        return self._envelope.drift

    @property
    def drift_sigma(self) -> float:
        """Standard deviation of the drift; infinite before there is any."""
        envelope = self._envelope
        if not envelope.length_ns:
            return math.inf
        _, wait_sigma_ns = self._link.wait(envelope.span_ns, envelope.pause_ns)  # which may wander
        return 2 * (self._scatter_ns + wait_sigma_ns) / envelope.length_ns

    def measured_timer(self, timer_s: float) -> None:
        """Take the timer of the link as its driver reports it, s: it then holds, whatever was said before."""
        self._link.measured(timer_s * 1e9)

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
            self._reads.append((self._bytes_read - 1, arrival_ns, chunk_bytes))
            self._pauses.append(
                (start, arrival_ns - (arrival_ns if self._read_ns is None else self._read_ns))
            )
            self._read_ns = arrival_ns
        # A read after a pause holds old frames and new: all teach before the first is stamped.
        self._stamps = []
        if not frames:
            return self._stamps
        last = frames[-1]
        last_raw, _ = _raw_tick(last)
        for frame in frames:
            end = start + frame.end_offset
            size = V1_WIRE_BYTES if frame.version == 1 else V2_WIRE_BYTES
            latest_end_ns = arrival_ns - (self._bytes_read - 1 - end) * self._byte_ns
            latest_edge_ns = latest_end_ns - self._send_delay_ns - size * self._byte_ns
            raw, modulus = _raw_tick(frame)
            if frame is not last:
                ahead = (last_raw - raw) % modulus
                still = start + last.end_offset - end
                if ahead * size == still * frame.sample_count:  # nothing is missing up to the newest frame
                    after_ns = (self._bytes_read - 1 - start - last.end_offset) * self._byte_ns
                    newest_edge_ns = arrival_ns - after_ns - self._send_delay_ns - size * self._byte_ns
                    latest_edge_ns = min(latest_edge_ns, newest_edge_ns - ahead * TICK_NS)
            elapsed = self._unwrap(frame, raw, modulus, latest_edge_ns, self._silence_ns(end))
            self._learn(frame, end, size, latest_end_ns, is_last=frame is last)
            self._taught.append((self._tick, elapsed))
        self._stamp_taught()
        return self._stamps

    # -- one counter --------------------------------------------------------------------------------

    def _silence_ns(self, end: int) -> int:
        """The longest pause between the reads since the frame before and the one with this byte."""
        longest_ns = 0
        while self._pauses:
            first_byte, pause_ns = self._pauses[0]
            if first_byte > end:
                break
            longest_ns = max(longest_ns, pause_ns)
            self._pauses.popleft()
        return longest_ns

    def _unwrap(
        self, frame: ImuFrame, raw: int, modulus: int, latest_edge_ns: float, silence_ns: int
    ) -> int | None:
        """Advance the unwrapped tick; return the ticks since the last frame, None at a new epoch."""
        if not self._is_started:
            self._start(raw, latest_edge_ns)
            return None
        elapsed = (raw - self._raw_tick) % modulus
        is_first = raw <= _FIRST_TICKS * frame.sample_count and silence_ns > _PAUSE_NS
        if elapsed != frame.sample_count or is_first:
            late_ns = self._lateness_ns(self._tick + elapsed, latest_edge_ns)
            wraps = math.floor(
                (late_ns + _EARLY_NS + self._line_sigma_ns(latest_edge_ns)) / (modulus * TICK_NS)
            )
            if wraps > 0:
                elapsed += wraps * modulus
                late_ns -= wraps * modulus * TICK_NS
            # in sequence by chance, it is late by the whole silence
            is_first &= elapsed != frame.sample_count
            if elapsed == 0 or not self._fits(late_ns, latest_edge_ns, is_first=is_first):
                self._restart(raw, latest_edge_ns, late_ns)
                return None
        elif self._lasts():
            self._restart(raw, latest_edge_ns, 0.0)
            return None
        self._tick += elapsed
        self._raw_tick = raw
        return elapsed

    def _fits(self, late_ns: float, latest_edge_ns: float, *, is_first: bool) -> bool:
        """Whether a frame after others that are missing came when it had to, had they been lost."""
        doubt_ns = self._line_sigma_ns(latest_edge_ns)
        if is_first:
            return -_EARLY_NS - doubt_ns <= late_ns <= _EARLY_NS + self._usual_late_ns + doubt_ns
        return -_EARLY_NS - 3 * doubt_ns <= late_ns <= _LATE_NS + 2 * self._usual_late_ns + 3 * doubt_ns

    def _lasts(self) -> bool:
        """Whether arrivals have been late for too long."""
        envelope = self._envelope
        if envelope.recent_floor_ns < _LASTING_LATE_NS + 6 * envelope.scatter_ns:
            self._late_since_tick = None
        elif self._late_since_tick is None:
            self._late_since_tick = self._tick
        return (
            self._late_since_tick is not None and (self._tick - self._late_since_tick) * TICK_NS > _LASTS_NS
        )

    def _lateness_ns(self, tick: int, latest_edge_ns: float) -> float:
        device_ns = float(tick * TICK_NS)
        return self._envelope.gap_ns(device_ns, latest_edge_ns - self._origin_ns - device_ns)

    def _start(self, raw: int, latest_edge_ns: float) -> None:
        self._is_started = True
        self._tick = self._raw_tick = raw
        self._origin_ns = round(latest_edge_ns) - raw * TICK_NS
        self._next_departure_ns = self._late_since_tick = None

    def _restart(self, raw: int, latest_edge_ns: float, late_ns: float) -> None:
        self._stamp_taught()
        self.epoch += 1
        self._envelope = LowerEnvelope()
        self._widest_wait_ns = 0.0
        self._doubt_ns = late_ns if 0.0 < late_ns <= _STALL_NS else 0.0
        self._start(raw, latest_edge_ns)

    # -- one line -----------------------------------------------------------------------------------

    def _learn(self, frame: ImuFrame, end: int, size: int, latest_end_ns: float, *, is_last: bool) -> None:
        """Give the envelope each read that ended within this frame, and the last frame's own bound."""
        device_ns = float(self._tick * TICK_NS)
        departure_ns = device_ns + self._send_delay_ns
        reads = self._reads
        while reads and reads[0][0] <= end:
            last_byte, arrival_ns, read_bytes = reads.popleft()
            sent = last_byte - (end - size)
            if sent <= 0:  # it ended in rubbish or in a reply; the next byte may be this frame's first
                self._next_departure_ns = departure_ns if sent == 0 else None
                continue
            left_ns = departure_ns + sent * self._byte_ns
            to_next_ns = self._byte_ns
            if sent == size:
                to_next_ns += max(0.0, frame.sample_count * TICK_NS - size * self._byte_ns)
            first_ns, self._next_departure_ns = self._next_departure_ns, left_ns + to_next_ns
            pause_ns = 0.0 if read_bytes == FTDI_PACKET_BYTES else to_next_ns - self._byte_ns
            span_ns = self._least_span_ns(read_bytes)
            if first_ns is not None and first_ns <= left_ns:
                span_ns = left_ns - first_ns
            self._add(
                Point(device_ns, arrival_ns - self._origin_ns - left_ns, span_ns, pause_ns),
                is_backlog=read_bytes >= _BACKLOG_BYTES,
            )
        if is_last and end < self._bytes_read - 1:
            own_ns = latest_end_ns - self._origin_ns - departure_ns - size * self._byte_ns
            span_ns = self._least_span_ns(self._reads[-1][2])
            left_ns, first_ns = departure_ns + size * self._byte_ns, self._next_departure_ns
            if first_ns is not None and first_ns <= left_ns and len(reads) == 1:
                span_ns = max(span_ns, left_ns - first_ns)
            self._add(Point(device_ns, own_ns, span_ns), is_backlog=True)

    def _least_span_ns(self, read_bytes: int) -> float:
        """From the first byte of a packet to its last, where the pauses between them are not known."""
        return (min(read_bytes, FTDI_PACKET_BYTES) - 1) * self._byte_ns

    def _add(self, point: Point, *, is_backlog: bool) -> None:
        envelope = self._envelope
        envelope.add(point, is_backlog=is_backlog)
        late_ns = min(_LATEST_NOTED_NS, envelope.gap_ns(point.x_ns, point.y_ns))
        self._usual_late_ns = max(late_ns, 0.98 * self._usual_late_ns)
        if envelope.points_seen > _DOUBT_POINTS:
            self._doubt_ns = 0.0

    # -- stamps -------------------------------------------------------------------------------------

    def _stamp_taught(self) -> None:
        """Stamp the frames that have taught: the line is the same for all of them, and so is its sigma."""
        if not self._taught:
            return
        envelope = self._envelope
        wait_ns, wait_sigma_ns = self._link.wait(envelope.span_ns, envelope.pause_ns)
        self._widest_wait_ns = max(self._widest_wait_ns, wait_sigma_ns)
        variance_ns2 = (
            wait_sigma_ns**2
            + (SEND_DELAY_STD_S * 1e9) ** 2
            + self._line_sigma_ns(self._origin_ns + float(self._tick * TICK_NS)) ** 2
            + max(envelope.recent_floor_ns, self._doubt_ns) ** 2
        )
        sigma_ns, is_locked = math.sqrt(variance_ns2), self.is_locked
        for tick, elapsed in self._taught:
            device_ns = float(tick * TICK_NS)
            wanted_ns = self._origin_ns + round(device_ns + envelope.height_ns(device_ns) - wait_ns)
            stamp_ns = self._slewed(wanted_ns, elapsed, is_locked=is_locked)
            sigma_s = (sigma_ns + abs(stamp_ns - wanted_ns)) * 1e-9
            self._stamps.append(TickStamp(stamp_ns, sigma_s, tick, elapsed, self.epoch))
        self._taught = []

    def _slewed(self, wanted_ns: int, elapsed: int | None, *, is_locked: bool) -> int:
        """Move the stamp towards the line no faster than allowed."""
        last_ns, stamp_ns = self._last_stamp_ns, wanted_ns
        if last_ns is not None:
            nominal_ns = float((elapsed or 0) * TICK_NS)
            if is_locked and elapsed is not None:
                nominal_ns *= 1 + self._envelope.drift
                stamp_ns = min(stamp_ns, last_ns + math.floor(nominal_ns * (1 + SLEW_LIMIT)))
            limit = SLEW_LIMIT if is_locked else _UNLOCKED_SLEW_LIMIT
            stamp_ns = max(stamp_ns, last_ns + max(1, math.ceil(nominal_ns * (1 - limit))))
        self._last_stamp_ns = stamp_ns
        return stamp_ns

    @property
    def _scatter_ns(self) -> float:
        """Of the arrivals that carry the line; what is assumed fades as arrivals are seen."""
        envelope = self._envelope
        first_guess_ns = self._link.longest_timer_ns + max(FIRST_JITTER_NS, self._usual_late_ns)
        witnesses = min(envelope.points_seen, envelope.length_ns / _WITNESS_NS)
        return max(envelope.scatter_ns, 20e3) + 2.5 * first_guess_ns / (witnesses + 1)

    def _line_sigma_ns(self, at_ns: float) -> float:
        """Of the line's height at a moment of the host: the further from the data, the more."""
        envelope = self._envelope
        length_ns = envelope.length_ns
        if not length_ns:
            return self._scatter_ns
        newest_ns = self._origin_ns + float(self._tick * TICK_NS)
        beyond_ns = max(0.0, at_ns - newest_ns)
        # a wait that grows as a timer slides along the frames looks like drift until it has begun anew
        wandering_ns = self._widest_wait_ns / (1.0 + (length_ns / SECOND_NS) ** 2)
        return (self._scatter_ns + wandering_ns) * (1.0 + 2.0 * beyond_ns / length_ns)


def _raw_tick(frame: ImuFrame) -> tuple[int, int]:
    """Return the tick that a frame states, and modulo what."""
    if frame.tick_ms is not None:
        return frame.tick_ms, 65536
    return (frame.sequence or 0) * frame.sample_count, 256 * frame.sample_count
