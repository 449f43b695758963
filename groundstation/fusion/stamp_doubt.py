"""Stamps that contradict those before them, as they come: late or wild packets, or a clock that was set?"""

from __future__ import annotations

BACKWARD_PACKETS = 20
"""Packets in a row behind the newest one, going on from each other, after which the clock has changed."""
AHEAD_PACKETS = 3
"""Likewise far ahead of the sensor's ticks."""
GOES_ON_NS = 1_000_000_000
"""A stamp goes on from the one before if it is later by less than this."""


class StampDoubt:
    """Counts packets in a row whose stamps contradict what is known."""

    __slots__ = ("_last_ns", "count")

    def __init__(self) -> None:
        self.count = 0
        """In a row that go on from each other; whoever takes a good packet sets it to 0."""
        self._last_ns = 0

    def is_followed(self, t_ns: int, packets: int) -> bool:
        """Take one more; whether so many go on from each other that the clock, not they, has changed."""
        if not self.count or not 0 < t_ns - self._last_ns < GOES_ON_NS:
            self.count = 0
        self.count += 1
        self._last_ns = t_ns
        return self.count >= packets
