"""Fewer points that draw the same picture: the least and the largest value of each column of pixels."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
LONGEST_GAP = 8.0
"""A line is broken where nothing came for so many of the usual steps."""


class Envelope(NamedTuple):
    """What each occupied column of pixels holds, shape (k,) each; NaN where a line is to be broken."""

    t: Array
    low: Array
    high: Array


def envelope(t: Array, values: Array, start: float, stop: float, columns: int) -> Envelope:
    """Least and largest value in each of ``columns`` equal spans of time; none is left out.

    Args:
        t: Ascending; shape (n,). What is outside of start and stop is not drawn.
        values: NaN where there is none; shape (n,).
        start: Left edge of the picture.
        stop: Right edge.
        columns: Of pixels.
    """
    inside = (t >= start) & (t <= stop)
    t, values = t[inside], values[inside]
    if not len(t):
        return Envelope(t, values, values)
    steps = np.diff(t)
    longest = LONGEST_GAP * float(np.median(steps)) if len(steps) else 0.0
    if len(t) <= columns:
        first, low, high, middle = np.arange(len(t)), values, values, t
    else:
        column = np.minimum(((t - start) * (columns / (stop - start))).astype(np.int64), columns - 1)
        first = np.flatnonzero(np.diff(column, prepend=-1))
        low, high = np.fmin.reduceat(values, first), np.fmax.reduceat(values, first)
        middle = start + (column[first] + 0.5) * (stop - start) / columns
        longest = max(longest, 2.0 * (stop - start) / columns)
    broken = first[1:][(t[first[1:]] - t[first[1:] - 1]) > longest] if longest else first[:0]
    at = np.searchsorted(first, broken)
    return Envelope(*(np.insert(each, at, np.nan) for each in (middle, low, high)))


def as_line(found: Envelope) -> tuple[Array, Array]:
    """One line through all of it; shape (m,) each."""
    if np.array_equal(found.low, found.high, equal_nan=True):
        return found.t, found.low
    t = np.repeat(found.t, 2)
    values = np.empty(len(t))
    values[0::2], values[1::2] = found.low, found.high
    values[2::4], values[3::4] = found.high[1::2], found.low[1::2]  # down where it came down: shorter ways
    return t, values


def without_repeats(x: Array, y: Array, step: float) -> tuple[Array, Array]:
    """A way in a plane without the points that lie within ``step`` of the last one kept of their grid."""
    if not len(x):
        return x, y
    cells = np.round(np.column_stack([x, y]) / step)
    is_new = np.append(True, np.any(np.diff(cells, axis=0) != 0.0, axis=1))
    is_new[-1] = True
    return x[is_new], y[is_new]


def share(t: Array, open_s: Array, start: float, stop: float, columns: int) -> Array:
    """How much of each column of pixels something was open: 0 to 1, shape (columns,).

    Args:
        t: When it opened; shape (n,).
        open_s: For how long; shape (n,).
        start: Left edge of the picture.
        stop: Right edge.
        columns: Of pixels.
    """
    edges = np.linspace(start, stop, columns + 1)
    began, total = np.append(t, np.inf), np.append(0.0, np.cumsum(open_s))
    index = np.searchsorted(t, edges, side="right") - 1
    before = np.where(index >= 0, total[index], 0.0)
    length = np.where(index >= 0, np.append(open_s, 0.0)[index], 0.0)
    since = edges - began[index]
    so_far = before + np.where(index >= 0, np.minimum(since, length), 0.0)
    found: Array = np.diff(so_far) * (columns / (stop - start))
    return np.clip(found, 0.0, 1.0)
