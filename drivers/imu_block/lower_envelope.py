"""A straight line under a cloud of late arrivals: clock offset and drift from one-way delays.

A byte can arrive late for many reasons (USB timers, a busy host) but never early. Seen over the sender's
clock, arrival minus departure is therefore a cloud above a straight line whose height is the clock offset and
whose slope is the drift. Of all lines below the cloud the one with the least mean distance is wanted: it runs
along the edge of the cloud's lower convex hull that spans the mean abscissa (Moon, Skelly and Towsley,
"Estimation and removal of clock skew from network delay measurements", IEEE INFOCOM 1999).

To bound the work, each second is thinned to its own lower hull, which loses nothing; a minute is kept.
"""

from collections import deque
from itertools import pairwise
from statistics import median
from typing import NamedTuple

SECOND_NS = 1_000_000_000
SECONDS_KEPT = 60
DRIFT_LIMIT = 0.01
"""Ceramic resonators are off by 0.5 %; beyond twice that a stream is not counted in milliseconds."""

_NEAR_NS = 50e3
_FIRST_FIT_NS = 62_500_000
_FITS_PER_SPAN = 8
"""A fit is made anew when the data have become an eighth longer, once a second at the latest."""
_RECENT_NS = 125_000_000
_RECENT_KEPT = 4


class Point(NamedTuple):
    """One arrival.

    Attributes:
        x_ns: Departure by the sender's clock.
        y_ns: Arrival minus departure.
        span_ns: From the departure of the packet's first byte to that of its last; None if unknown.
        pause_ns: From the departure of its last byte to that of the next one; None if unknown.
    """

    x_ns: float
    y_ns: float
    span_ns: float | None = None
    pause_ns: float | None = None


class LowerEnvelope:
    """The line ``height(x) = offset + drift x`` under all points of the last minute, abscissae in ns.

    Cost: a few comparisons per point; once per second of abscissa one pass over some hundred points.

    Attributes:
        points_seen: So far.
        drift: Slope of the line, within ``DRIFT_LIMIT``.
        scatter_ns: Median height of the seconds' lowest points over the line: a stall is no scatter.
        span_ns, pause_ns: Medians of the points that carry the line, None while unknown.
        length_ns: Abscissae from the oldest point that is kept to the newest.
        recent_floor_ns: How far the lowest point of the last half second lay over the line when it came.
    """

    def __init__(self) -> None:
        self.points_seen = 0
        self.drift = 0.0
        self.scatter_ns = 0.0
        self.span_ns: float | None = None
        self.pause_ns: float | None = None
        self.length_ns = 0.0
        self.recent_floor_ns = 0.0
        self._offset_ns = float("inf")
        self._seconds: deque[list[Point]] = deque(maxlen=SECONDS_KEPT)
        self._second_end_ns = -float("inf")
        self._next_fit_ns = float("inf")
        self._recent: deque[tuple[float, float]] = deque(maxlen=_RECENT_KEPT)

    def height_ns(self, x_ns: float) -> float:
        """Return the line's height at ``x_ns``; infinite before the first point."""
        return self._offset_ns + self.drift * x_ns

    def gap_ns(self, x_ns: float, y_ns: float) -> float:
        """Return how far a point lies over the line."""
        return y_ns - self._offset_ns - self.drift * x_ns

    def add(self, point: Point, *, is_backlog: bool = False) -> None:
        """Take one point; abscissae must not go back.

        Args:
            point: The arrival.
            is_backlog: It waited in a buffer of the host: that it is late means nothing.
        """
        self.points_seen += 1
        if point.x_ns >= self._second_end_ns:
            self._seconds.append([])
            self._second_end_ns = point.x_ns + SECOND_NS
            if self.points_seen == 1:
                self._next_fit_ns = point.x_ns + _FIRST_FIT_NS
        _append_to_hull(self._seconds[-1], point)
        self.length_ns = point.x_ns - self._seconds[0][0].x_ns
        gap_ns = self.gap_ns(point.x_ns, point.y_ns)
        if gap_ns < 0.0:
            self._offset_ns = point.y_ns - self.drift * point.x_ns
            if gap_ns < -self.scatter_ns - _NEAR_NS:  # now it carries the line
                self.span_ns, self.pause_ns = point.span_ns, point.pause_ns
            gap_ns = 0.0
        if not is_backlog:
            self._note_recent(point.x_ns, gap_ns)
        if point.x_ns >= self._next_fit_ns:
            self._fit()
            self._next_fit_ns = point.x_ns + min(SECOND_NS, self.length_ns / _FITS_PER_SPAN)

    def _note_recent(self, x_ns: float, gap_ns: float) -> None:
        recent = self._recent
        if recent and x_ns < recent[-1][0]:
            if gap_ns < recent[-1][1]:
                recent[-1] = recent[-1][0], gap_ns
        else:
            recent.append((x_ns + _RECENT_NS, gap_ns))
        self.recent_floor_ns = min([gap for _, gap in recent])

    def _fit(self) -> None:
        hull: list[Point] = []
        for second in self._seconds:
            for point in second:
                _append_to_hull(hull, point)
        self.drift = _slope_over_the_middle(hull)
        self._offset_ns = min(point.y_ns - self.drift * point.x_ns for point in hull)
        lowest = [
            min(((self.gap_ns(at.x_ns, at.y_ns), at) for at in second), key=lambda row: row[0])
            for second in self._seconds
        ]
        self.scatter_ns = median(gap_ns for gap_ns, _ in lowest)
        near = [point for gap_ns, point in lowest if gap_ns <= self.scatter_ns + _NEAR_NS]
        spans = [point.span_ns for point in near if point.span_ns is not None]
        pauses = [point.pause_ns for point in near if point.pause_ns is not None]
        self.span_ns = median(spans) if spans else None
        self.pause_ns = median(pauses) if pauses else None


def _append_to_hull(hull: list[Point], point: Point) -> None:
    """Add a point that lies not left of the others to their lower convex hull."""
    x_ns, y_ns = point[:2]
    if hull and hull[-1][0] == x_ns:
        if hull[-1][1] <= y_ns:
            return
        hull.pop()
    while len(hull) > 1:
        (ax_ns, ay_ns, _, _), (bx_ns, by_ns, _, _) = hull[-2], hull[-1]
        if (bx_ns - ax_ns) * (y_ns - ay_ns) > (by_ns - ay_ns) * (x_ns - ax_ns):
            break  # it turns to the left
        hull.pop()
    hull.append(point)


def _slope_over_the_middle(hull: list[Point]) -> float:
    """Return the slope of the hull's edge over the middle of the abscissae, within the drift limit."""
    middle_ns = (hull[0].x_ns + hull[-1].x_ns) / 2
    for a, b in pairwise(hull):
        if b.x_ns >= middle_ns:
            return max(-DRIFT_LIMIT, min(DRIFT_LIMIT, (b.y_ns - a.y_ns) / (b.x_ns - a.x_ns)))
    return 0.0
