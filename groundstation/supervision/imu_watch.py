"""Whether the samples of an IMU block can be flown by. Pure."""

from collections.abc import Iterator

SILENT_S = 0.3
FIRST_SAMPLE_S = 3.0
"""After so long without any sample a block is dead and does not only start."""
BAD_S = 0.1
"""So long in a row samples must be refused before it is a fault: one bad frame is noise."""
JUMP_MS = 200
"""Ticks between two samples beyond what a line loses."""
STUCK, OTHER_BLOCK = "stuck", "this is block"
"""What the reader's reasons hold."""


class ImuWatch:
    """Follows the samples of one block."""

    def __init__(self) -> None:
        self._arrival_ns: int | None = None
        self._watched_since_ns: int | None = None
        self._bad_since_ns: int | None = None
        self._reason = ""
        self._is_rate_usable = True
        self._tick_ms = 0
        self._jump = ""
        self._jump_ns = 0

    def take(
        self,
        now_ns: int,
        *,
        is_valid: bool,
        is_rate_usable: bool,
        reason: str,
        tick_ms: int,
    ) -> None:
        """Account for a sample.

        Args:
            now_ns: Its arrival.
            is_valid: Whether the reader believes it.
            is_rate_usable: Whether the reader believes its turn rate at least.
            reason: Why not.
            tick_ms: Its ticks since its start.
        """
        if self._arrival_ns is not None:
            waited_ms = (now_ns - self._arrival_ns) // 1_000_000
            ticked_ms = tick_ms - self._tick_ms
            if ticked_ms < 0:
                self._jump, self._jump_ns = "the block has started again", now_ns
            elif ticked_ms > waited_ms + JUMP_MS:
                self._jump, self._jump_ns = f"by {ticked_ms - waited_ms} ms", now_ns
        self._arrival_ns, self._tick_ms = now_ns, tick_ms
        if is_valid:
            self._bad_since_ns = None
        elif self._bad_since_ns is None:
            self._bad_since_ns = now_ns
        self._reason, self._is_rate_usable = reason, is_rate_usable

    def findings(self, now_ns: int) -> Iterator[tuple[str, str]]:
        """Faults at this moment, by id with details; before the first sample only that none comes."""
        if self._arrival_ns is None:
            if self._watched_since_ns is None:
                self._watched_since_ns = now_ns
            if now_ns - self._watched_since_ns > FIRST_SAMPLE_S * 1e9:
                yield "imu_silent", "no sample has come yet"
            return
        silent_s = (now_ns - self._arrival_ns) * 1e-9
        if silent_s > SILENT_S:
            yield "imu_silent", f"the newest sample is {silent_s:.2f} s old"
        elif self._bad_since_ns is not None and now_ns - self._bad_since_ns >= BAD_S * 1e9:
            degraded = "accelerometer_lost"
            yield degraded if self._is_rate_usable else _fault_of(self._reason), self._reason
        if self._jump and now_ns - self._jump_ns < 1_000_000_000:
            yield "imu_clock_jumped", self._jump


def _fault_of(reason: str) -> str:
    if OTHER_BLOCK in reason:
        return "imu_of_another_vehicle"
    return "imu_stuck" if STUCK in reason else "imu_implausible"
