"""A straight line under a cloud of late arrivals: clock offset and drift from one-way delays.

A byte can arrive late for many reasons (USB timers, a busy host) but never early. Seen over the sender's
clock, arrival minus departure is therefore a cloud above a straight line whose height is the clock offset and
whose slope is the drift. Of all lines below the cloud the one with the least mean distance is wanted: it runs
along the edge of the cloud's lower convex hull that spans the mean abscissa (Moon, Skelly and Towsley,
"Estimation and removal of clock skew from network delay measurements", IEEE INFOCOM 1999).

To bound the work, the cloud is thinned to the lowest point of each second; a minute of them is kept.
"""

from collections import deque
from itertools import pairwise

BLOCK_NS = 1_000_000_000
BLOCKS_KEPT = 60
LAST_BLOCKS = 5
DRIFT_LIMIT = 150e-6
"""Crystals of block and host together: 2 x 50 ppm, and some room for temperature."""

Point = tuple[float, float]


class LowerEnvelope:
    """The line ``height(x) = offset + drift x`` under all recent points, abscissae in ns.

    Cost: a comparison per point; once per second of abscissa one pass over at most 60 points.
    """

    def __init__(self) -> None:
        self.points_seen = 0
        self.drift = 0.0
        self._offset_ns = float("inf")
        self._blocks: deque[Point] = deque(maxlen=BLOCKS_KEPT)
        self._block_end: float | None = None
        self._lowest: Point = (0.0, float("inf"))
        self._lowest_gap = float("inf")
        self._mean_gap_ns = 0.0
        self._lowest_of_last = 0.0

    @property
    def blocks_closed(self) -> int:
        """Seconds of data in the line, at most 60."""
        return len(self._blocks)

    @property
    def scatter_ns(self) -> float:
        """Mean height of the seconds' lowest points over the line."""
        return self._mean_gap_ns

    def height_ns(self, x_ns: float) -> float:
        """Return the line's height at ``x_ns``; infinite before the first point."""
        return self._offset_ns + self.drift * x_ns

    def floor_of_last_blocks_ns(self) -> float:
        """Return how far the lowest of the last five seconds lies over the line (0 with fewer)."""
        return self._lowest_of_last - self._offset_ns if len(self._blocks) >= LAST_BLOCKS else 0.0

    def add(self, x_ns: float, y_ns: float) -> None:
        """Take one point; abscissae must not go back by more than a block."""
        self.points_seen += 1
        if self._block_end is None:
            self._block_end = x_ns + BLOCK_NS
        elif x_ns >= self._block_end:
            self._close_block()
            self._block_end = x_ns + BLOCK_NS
        gap = y_ns - self._offset_ns - self.drift * x_ns
        if gap < 0.0:
            self._offset_ns = y_ns - self.drift * x_ns
            self._lowest, self._lowest_gap = (x_ns, y_ns), 0.0
        elif gap < self._lowest_gap:
            self._lowest, self._lowest_gap = (x_ns, y_ns), gap

    def _gap(self, point: Point) -> float:
        return point[1] - self._offset_ns - self.drift * point[0]

    def _close_block(self) -> None:
        if self._lowest_gap < float("inf"):
            self._blocks.append(self._lowest)
        self._lowest_gap = float("inf")
        if not self._blocks:
            return
        points = list(self._blocks)
        self.drift = _drift(points)
        heights = [y - self.drift * x for x, y in points]
        self._offset_ns = min(heights)
        self._lowest_of_last = min(heights[-LAST_BLOCKS:])
        self._mean_gap_ns = sum(map(self._gap, points)) / len(points)


def _drift(points: list[Point]) -> float:
    """Return the slope of the lower hull's edge over the mean abscissa, within the drift limit."""
    if len(points) < 2:
        return 0.0
    hull: list[Point] = []
    for point in points:
        while len(hull) > 1 and _turns_clockwise(hull[-2], hull[-1], point):
            hull.pop()
        hull.append(point)
    middle = sum(x for x, _ in points) / len(points)
    for (x0, y0), (x1, y1) in pairwise(hull):
        if x1 >= middle:
            return max(-DRIFT_LIMIT, min(DRIFT_LIMIT, (y1 - y0) / (x1 - x0)))
    return 0.0


def _turns_clockwise(a: Point, b: Point, c: Point) -> bool:
    return (b[0] - a[0]) * (c[1] - a[1]) <= (b[1] - a[1]) * (c[0] - a[0])
