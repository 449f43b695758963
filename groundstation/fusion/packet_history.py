"""The packets between the last used exposure and now, kept for re-integration."""

from __future__ import annotations

from array import array
from bisect import bisect_left, bisect_right
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

COLUMNS = 7
"""end s, span s, rate rad/s, ax, ay m/s^2, temperature above reference K, 1 where nothing was measured."""


@dataclass(frozen=True, slots=True, eq=False)
class Segment:
    """Consecutive packets, cut to an interval; arrays of shape (n,), body frame, at the accelerometers."""

    end_s: Array
    span_s: Array
    rate_rad_s: Array
    ax_m_s2: Array
    ay_m_s2: Array
    warmth_k: Array
    """Temperature above the reference temperature of the biases."""
    is_hole: Array
    """1.0 where the values were made up from the neighbours."""
    start_s: float
    stop_s: float


class PacketHistory:
    """Growing rows of packets, cut off at the front; appending costs a quarter of a microsecond.

    The hot path appends to `rows` directly, seven floats at a time in the order of `COLUMNS`.
    """

    __slots__ = ("rows",)

    def __init__(self) -> None:
        self.rows = array("d")

    def __len__(self) -> int:
        return len(self.rows) // COLUMNS

    @property
    def first_s(self) -> float:
        """Start of the oldest kept packet."""
        return self.rows[0] - self.rows[1]

    def forget_before(self, t_s: float, keep: int = 64) -> None:
        """Drop packets that ended at or before `t_s`, except the newest `keep` of them."""
        first = bisect_right(self._ends(), t_s) - keep
        if first > 0:
            del self.rows[: first * COLUMNS]

    def clear(self) -> None:
        """Drop everything."""
        del self.rows[:]

    def rate_at(self, t_s: float) -> float:
        """Return the gyro's reading in the packet that covers `t_s`, or in the nearest one."""
        row = min(bisect_left(self._ends(), t_s), len(self) - 1)
        return self.rows[row * COLUMNS + 2]

    def jump_rad_s(self) -> float:
        """Return by how much the gyro read more after the newest hole than before it."""
        rates = self.rows[-3 * COLUMNS + 2 :: COLUMNS]
        return rates[-1] - rates[0] if len(rates) == 3 else 0.0

    def between(self, start_s: float, stop_s: float) -> Segment:
        """Return a copy of the packets that cover `start_s` to `stop_s`, the outer two cut.

        Time before the first packet, which nothing covers, is left out: the segment starts later.
        """
        ends = self._ends()
        first = bisect_right(ends, start_s + 1e-9)
        last = min(bisect_left(ends, stop_s - 1e-9), len(ends) - 1)
        if last < first:
            empty = np.zeros(0)
            return Segment(empty, empty, empty, empty, empty, empty, empty, start_s, start_s)
        part = np.array(self.rows[first * COLUMNS : (last + 1) * COLUMNS]).reshape(-1, COLUMNS).T.copy()
        part[1, 0] = min(part[1, 0], part[0, 0] - start_s)
        if part[0, -1] > stop_s:
            part[1, -1] -= part[0, -1] - stop_s
            part[0, -1] = stop_s
        begin, end = float(part[0, 0] - part[1, 0]), float(part[0, -1])
        return Segment(part[0], part[1], part[2], part[3], part[4], part[5], part[6], begin, end)

    def _ends(self) -> array[float]:
        """End of each packet: a copy, for the rows cannot grow while anything looks at them.

        A view would do only if nobody kept the frame that holds it, as profilers and debuggers do.
        """
        return self.rows[::COLUMNS]
