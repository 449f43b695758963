"""Ticks of a sensor recovered from jittering stamps, where the frames carry none."""

from __future__ import annotations

PHASE_GAIN = 0.02
"""Share of a stamp's difference that the grid follows: 50 packets of memory, enough for any clock's drift."""
MAX_OFF_PERIODS = 0.5
"""A stamp further from the grid belongs to another tick."""


class StampTicks:
    """Counts how many averaging windows lie between packets.

    A block that polls by a quartz has windows of equal length; what jitters is the stamp. Integrating with
    the grid instead of the stamps' differences removes the jitter from the impulses.

    Args:
        period_s: nominal averaging window.
    """

    __slots__ = ("_grid_s", "_period_s")

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._grid_s: float | None = None

    def elapsed_s(self, stamp_s: float) -> float:
        """Return the time from the last packet to the one stamped `stamp_s`, whole windows, at least one."""
        period = self._period_s
        if self._grid_s is None:
            self._grid_s = stamp_s
            return period
        windows = max(1, round((stamp_s - self._grid_s) / period))
        grid = self._grid_s + windows * period
        off = stamp_s - grid
        if abs(off) > MAX_OFF_PERIODS * period:
            # the clock jumped back, or a packet came twice: the consumer judges the stamp, the grid stays
            return period
        self._grid_s = grid + PHASE_GAIN * off
        return windows * period
