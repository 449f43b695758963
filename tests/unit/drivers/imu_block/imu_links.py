"""Simulated links: a block, its serial line, an FTDI chip, a busy host; and the clock that follows them."""

from dataclasses import dataclass, field

import numpy as np

from drivers.imu_block.clock import TickClock
from drivers.imu_block.protocol import (
    V1_WIRE_BYTES,
    V2_WIRE_BYTES,
    FrameParser,
    ImuFrame,
    encode_v1,
    encode_v2,
)

PACKET_BYTES = 62


@dataclass
class Link:
    version: int = 2
    sample_count: int = 4
    baud: int = 250_000
    timer_s: float = 0.016
    drift: float = 50e-6
    duration_s: float = 30.0
    jitter_s: float = 0.0003
    stall_every_s: float = 0.0
    stall_s: float = 0.03
    first_tick: int = 0
    first_sequence: int = 0
    start_ns: int = 7_000_000_000
    send_jitter_s: float = 0.0001
    is_free_running: bool = False
    seed: int = 1
    reads: list[tuple[int, bytes]] = field(default_factory=list)
    truth_ns: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def run(self) -> "Link":
        rng = np.random.default_rng(self.seed)
        count = int(self.duration_s * 1000 / self.sample_count)
        ticks = self.first_tick + self.sample_count * (1 + np.arange(count))
        edges_s = (ticks - self.first_tick) * 1e-3 * (1 + self.drift)
        size = V1_WIRE_BYTES if self.version == 1 else V2_WIRE_BYTES
        starts_s = edges_s + 0.0005 + rng.uniform(-1, 1, count) * self.send_jitter_s
        byte_s = 10 / self.baud
        done_s = (starts_s[:, None] + byte_s * (1 + np.arange(size))[None, :]).ravel()
        stream = b"".join(self._frame(int(tick), index) for index, tick in enumerate(ticks))
        arrivals_s, ends = self._through_the_chip(done_s)
        arrivals_s = (
            arrivals_s + rng.exponential(self.jitter_s, len(arrivals_s)) if self.jitter_s else arrivals_s
        )
        if self.stall_every_s:
            in_stall = (arrivals_s % self.stall_every_s) < self.stall_s
            released = (arrivals_s // self.stall_every_s) * self.stall_every_s + self.stall_s
            arrivals_s = np.where(in_stall, released, arrivals_s)
        arrivals_s = np.maximum.accumulate(arrivals_s)
        last_of_read = np.append(arrivals_s[1:] > arrivals_s[:-1], True)  # what waits is read at once
        arrivals_s, ends = arrivals_s[last_of_read], np.asarray(ends)[last_of_read]
        begins = np.concatenate([[0], ends[:-1]])
        self.reads = [
            (self.start_ns + round(a * 1e9), stream[b:e])
            for a, b, e in zip(arrivals_s, begins, ends, strict=True)
        ]
        self.truth_ns = self.start_ns + np.round(edges_s * 1e9)
        return self

    def _frame(self, tick: int, index: int) -> bytes:
        if self.version == 1:
            return encode_v1(
                sequence=self.first_sequence + index + 1, gyro_counts=2048, tilt_difference_counts=(0, 0)
            )
        return encode_v2(
            tick_ms=tick,
            sample_count=self.sample_count,
            gyro_counts=2048,
            tilt_counts=(1024, 1024, 1024, 1024),
            housekeeping=(0, 2048),
        )

    def _through_the_chip(self, done_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Release bytes when 62 wait or the timer has run since the first waiting byte."""
        if not self.timer_s:
            return done_s, np.arange(1, len(done_s) + 1)
        arrivals, ends = [], []
        begin, sent_s = 0, 0.0
        while begin < len(done_s):
            expiry = done_s[begin] + self.timer_s
            if self.is_free_running:  # from the packet before, be it empty
                expiry = sent_s + self.timer_s * np.floor((done_s[begin] - sent_s) / self.timer_s + 1)
            waiting = int(np.searchsorted(done_s, expiry, side="right"))
            end = min(waiting, begin + PACKET_BYTES)
            arrivals.append(done_s[end - 1] if end == begin + PACKET_BYTES else expiry)
            ends.append(end)
            sent_s = arrivals[-1]
            begin = end
        return np.array(arrivals), np.array(ends)


@dataclass
class Flight:
    stamps: list
    clock: TickClock
    error_s: np.ndarray
    sigma_s: np.ndarray
    locked_from: int


def fly(*links, said_s=None):
    """Run the reads of the links one after another through parser and clock.

    The link reports its timer, or somebody says what it is.
    """
    link = links[0]
    parser = FrameParser(link.version, v1_sample_count=link.sample_count)
    clock = TickClock(link.baud) if said_s is None else TickClock(link.baud, latency_timer_s=said_s)
    if said_s is None:
        clock.measured_timer(link.timer_s)
    stamps, locked_from, truths = [], None, []
    for each in links:
        before = len(stamps)
        for arrival_ns, chunk in each.run().reads:
            frames = [frame for frame in parser.feed(chunk) if isinstance(frame, ImuFrame)]
            stamps += clock.update(arrival_ns, len(chunk), frames)
            if locked_from is None and clock.is_locked:
                locked_from = len(stamps)
        # a block that begins anew may lose its first frames: the parser waits until they follow each other
        truths.append(each.truth_ns[len(each.truth_ns) - (len(stamps) - before) :])
    truth = np.concatenate(truths)
    got = np.array([stamp.stamp_ns for stamp in stamps], dtype=float)
    sigma = np.array([stamp.stamp_sigma_s for stamp in stamps])
    return Flight(stamps, clock, (got - truth) * 1e-9, sigma, locked_from or len(stamps))


def assert_stamps_keep_their_promises(flight):
    """Monotone, slewed at most 500 ppm after lock, never worse than 2.5 stated deviations."""
    steps = np.diff([stamp.stamp_ns for stamp in flight.stamps])
    assert (steps > 0).all()
    ticks = np.array([stamp.elapsed_ticks for stamp in flight.stamps[1:]])
    ratio = steps[flight.locked_from :] / (ticks[flight.locked_from :] * 1e6)
    assert np.abs(ratio - 1).max() <= 500.001e-6
    assert (np.abs(flight.error_s) / flight.sigma_s).max() < 2.5
