"""The wire from a microcontroller's USART through an FTDI chip to the host's read.

Bytes leave one by one at the real baud rate. The FTDI chip hands them on in packets: as soon as 62 wait, or
when the latency timer has run since the first of them (FTDI AN232B-04). The host's USB stack adds a little
random time. Line failures act on bytes before they reach the chip.
"""

from collections import deque

import numpy as np

from firmware_emulator.devices.pending import take_until
from firmware_emulator.failures import Failures

NS_PER_S = 1_000_000_000
BITS_PER_BYTE = 10  # start, eight data, stop
PACKET_BYTES = 62  # a 64-byte USB packet carries two status bytes
ACTUAL_BAUD = {115200: 20e6 / (16 * 11), 250000: 250e3}  # PIC at 20 MHz, BRGH = 1: 113636 for 115200
_JITTER_BLOCK = 256


class SerialLine:
    """One direction, block to host, in virtual time.

    Args:
        baud: Nominal rate, a key of `ACTUAL_BAUD`.
        latency_s: FTDI latency timer.
        host_jitter_s: Mean of the exponentially distributed wait of a packet in the host.
        failures: Line failures.
        rng: For jitter and failures.
        start_ns: Laboratory time that the failures count from.
    """

    def __init__(
        self,
        baud: int,
        latency_s: float,
        host_jitter_s: float,
        failures: Failures,
        rng: np.random.Generator,
        start_ns: int = 0,
    ) -> None:
        self.byte_ns = BITS_PER_BYTE * NS_PER_S / ACTUAL_BAUD[baud]
        self._latency_ns = round(latency_s * NS_PER_S)
        self._jitter_s = host_jitter_s
        self._failures = failures
        self._rng = rng
        self._start_ns = start_ns
        self.free_ns = start_ns  # when the last bit handed over so far has left
        self._waiting = bytearray()
        self._timer_ns = 0
        self._packets: deque[tuple[int, bytes]] = deque()
        self._last_arrival_ns = start_ns
        self._jitters_ns: list[int] = []
        self._jitter_ns = self._draw_jitter_ns()  # of the next packet: lets its arrival be foretold

    def send(self, stamp_ns: int, data: bytes) -> int:
        """Put bytes on the line at `stamp_ns` or when it is free; return when the last bit has left."""
        begin_ns = max(stamp_ns, self.free_ns)
        self.free_ns = begin_ns + round(len(data) * self.byte_ns)
        if self._failures.has("bit_flips", "lost_bytes", "half_frames"):
            data = self._damage(data, begin_ns)
        self._buffer(data, begin_ns)
        return self.free_ns

    def next_arrival_ns(self, next_send_ns: int, next_bytes: int, quiet_ns: int) -> int:
        """Earliest stamp at which a packet may reach the host.

        Args:
            next_send_ns: Nothing is sent before.
            next_bytes: So many, at most, are sent then,
            quiet_ns: and again every so often.
        """
        if self._packets:
            return self._packets[0][0]
        missing = PACKET_BYTES - len(self._waiting)
        sends_before = (missing - 1) // next_bytes
        full_ns = next_send_ns + sends_before * quiet_ns
        full_ns += int((missing - sends_before * next_bytes) * self.byte_ns)
        timer_ns = self._timer_ns if self._waiting else next_send_ns + int(self.byte_ns) + self._latency_ns
        return min(timer_ns, full_ns) + self._jitter_ns

    def take(self, until_ns: int) -> list[tuple[int, bytes]]:
        """Packets that reached the host up to `until_ns`, as (stamp, bytes).

        Everything that is sent up to then must have been handed to `send` before.
        """
        if self._waiting and self._timer_ns <= until_ns:
            self._release(self._timer_ns)
        return take_until(self._packets, until_ns)

    def _buffer(self, data: bytes, begin_ns: int) -> None:
        done, size, byte_ns = 0, len(data), self.byte_ns
        while done < size:
            arrives_ns = begin_ns + round((done + 1) * byte_ns)
            if self._waiting and self._timer_ns < arrives_ns:
                self._release(self._timer_ns)
            if not self._waiting:
                self._timer_ns = arrives_ns + self._latency_ns
            before_timer = int((self._timer_ns - arrives_ns) / byte_ns) + 1
            count = min(size - done, PACKET_BYTES - len(self._waiting), before_timer)
            self._waiting += data[done : done + count]
            done += count
            if len(self._waiting) == PACKET_BYTES:
                self._release(begin_ns + round(done * byte_ns))

    def _release(self, stamp_ns: int) -> None:
        self._last_arrival_ns = max(self._last_arrival_ns, stamp_ns + self._jitter_ns)
        self._jitter_ns = self._draw_jitter_ns()
        self._packets.append((self._last_arrival_ns, bytes(self._waiting)))
        self._waiting.clear()

    def _draw_jitter_ns(self) -> int:
        if not self._jitters_ns:
            draws = self._rng.exponential(self._jitter_s * NS_PER_S, _JITTER_BLOCK)
            self._jitters_ns = draws.astype(np.int64).tolist()
        return self._jitters_ns.pop()

    def _damage(self, data: bytes, stamp_ns: int) -> bytes:
        age_ns = stamp_ns - self._start_ns
        half = self._failures.active("half_frames", age_ns)
        if half and self._rng.uniform() < half.parameters["probability_per_frame"]:
            data = data[: int(self._rng.integers(len(data)))]
        lost = self._failures.active("lost_bytes", age_ns)
        if lost and data:
            kept = self._rng.uniform(size=len(data)) >= lost.parameters["probability_per_byte"]
            data = np.frombuffer(data, np.uint8)[kept].tobytes()
        flips = self._failures.active("bit_flips", age_ns)
        if flips and data:
            flipped = self._rng.uniform(size=8 * len(data)) < flips.parameters["probability_per_bit"]
            data = (np.frombuffer(data, np.uint8) ^ np.packbits(flipped)).tobytes()
        return data
