"""Stamps behind the newest one: late packets, or a clock that jumped back?"""

from __future__ import annotations

BACKWARD_PACKETS = 20
"""Ascending stamps in a row behind the newest one after which the clock, not the packets, has changed."""


class BackwardStamps:
    """Counts packets that lie behind."""

    __slots__ = ("_last_ns", "count")

    def __init__(self) -> None:
        self.count = 0
        """In a row."""
        self._last_ns = 0

    def is_restart(self, t_ns: int) -> bool:
        """Take one more; whether they are by now a clock that jumped back, to be followed."""
        self.count += 1
        if self.count < BACKWARD_PACKETS or t_ns <= self._last_ns:
            self._last_ns = t_ns
            return False
        return True
