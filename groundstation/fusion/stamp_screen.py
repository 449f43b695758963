"""Which stamps of a recorded table are believed: the one judgement for files and recordings.

One wild stamp is an outlier, not a fact. Of a clock that runs on, the most rows that rise together are kept,
so that neither a stamp far ahead nor one behind takes its neighbours with it; nor does a stretch of them,
from which the clock comes back to where it would have been. A stamp after a long gap counts when others go
on from it. Many rows in a row that lie behind are a clock that was set back: a new epoch whose seconds are
counted on from the one before.
"""

from __future__ import annotations

import itertools
from bisect import bisect_left
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

EPOCH_ROWS = 20
"""Rows before and after, by whose medians it is judged whether a clock was set back."""
WITNESSES = 3
"""Rows that go on from each other after a long gap, so that the gap is one."""
LONG_GAP_S = 1.0
LONG_GAP_PERIODS = 20.0
MOST_JUMPS = 16
"""Within a stretch of wild stamps, until the clock is back."""
LARGEST_S = 1e12
"""Beyond is no time; also keeps nanoseconds of a stamp within 64 bits by far of anything that is kept."""

NOT_FINITE = "packet_stamp_not_finite"
BEHIND = "packet_stamp_not_after_the_last"
FAR = "packet_stamp_far_from_its_neighbours"
SET_BACK = "clock_jumped_back"
REPEATED = "packet_repeated"


@dataclass(frozen=True, slots=True, eq=False)
class Screened:
    """The stamps of a table after the judgement.

    Attributes:
        stamp_s: (n,) of one clock that rises, s; NaN where a row was set aside.
        aside: Rows that were set aside, by reason (a counter's name).
        set_back: Rows at which the clock was set back, and by how much, s.
        starts: Those of them at which it began anew, an unknown time later.
    """

    stamp_s: Array
    aside: dict[str, NDArray[np.intp]]
    set_back: tuple[tuple[int, float], ...]
    starts: tuple[int, ...] = ()


def stretches_of(stamp_s: Array, hole_s: float) -> list[NDArray[np.intp]]:
    """Return the rows of each stretch of rising stamps without a longer hole."""
    return np.split(np.arange(len(stamp_s)), np.flatnonzero(np.diff(stamp_s) > hole_s) + 1)


def spacing_of(stamp_s: Array) -> float:
    """Return the median spacing of rising stamps, s; NaN if there are none."""
    steps = np.diff(stamp_s[np.abs(stamp_s) < np.inf])
    steps = steps[steps > 0.0]
    return float(np.median(steps)) if len(steps) else float("nan")


def repeated_rows(table: Array) -> NDArray[np.bool_]:
    """Return which rows (n,) are equal to an earlier one in every column: pasted twice, not measured twice.

    Args:
        table: (n, k), stamps and readings.
    """
    _, first = np.unique(table, axis=0, return_index=True, equal_nan=False)
    again = np.ones(len(table), dtype=np.bool_)
    again[first] = False
    return again


def screen_stamps(stamp_s: Array, period_s: float, again: NDArray[np.bool_] | None = None) -> Screened:
    """Judge the stamps of a table in the order of its rows.

    Args:
        stamp_s: (n,) as given, s; anything.
        period_s: Of the rows, nominal.
        again: (n,) rows that repeat an earlier one: nothing follows from their stamps.
    """
    aside: dict[str, NDArray[np.intp]] = {}
    again = np.zeros(len(stamp_s), dtype=np.bool_) if again is None else again
    aside[REPEATED] = np.flatnonzero(again & np.isfinite(stamp_s))
    with np.errstate(invalid="ignore"):
        rows = np.flatnonzero((np.abs(stamp_s) < LARGEST_S) & ~again)
        aside[NOT_FINITE] = np.flatnonzero(~np.isfinite(stamp_s))
        aside[FAR] = np.flatnonzero(np.isfinite(stamp_s) & (np.abs(stamp_s) >= LARGEST_S) & ~again)
    out = np.full(len(stamp_s), np.nan)
    is_out = _out_and_back(stamp_s[rows], period_s)
    aside[FAR] = np.concatenate([aside[FAR], rows[is_out]])
    rows = rows[~is_out]
    t = stamp_s[rows]
    shift_s, set_back = 0.0, []
    edges = [0, *set_back_at(t), len(t)]
    behind, far = [], [aside[FAR]]
    newest_s = -np.inf
    for first, stop in itertools.pairwise(edges):
        part = t[first:stop]
        kept = _rising(part)
        lonely = _unwitnessed(part[kept], period_s)
        chain = kept[~lonely]
        if not len(chain):
            far.append(rows[first:stop])
            continue
        if np.isfinite(newest_s):
            shift_s = newest_s + period_s - float(part[chain[0]])
            set_back.append((int(rows[first]), float(t[first - 1] - t[first])))
        out[rows[first + chain]] = part[chain] + shift_s
        newest_s = float(part[chain[-1]] + shift_s)
        left = np.setdiff1d(np.arange(len(part)), chain)
        # what lies far from both neighbours in the file is wild; the rest came late, or twice
        place = np.clip(np.searchsorted(chain, left), 1, len(chain) - 1) if len(chain) > 1 else left * 0
        near = np.minimum(
            np.abs(part[left] - part[chain[place]]),
            np.abs(part[left] - part[chain[np.maximum(place - 1, 0)]]),
        )
        is_far = near > max(LONG_GAP_S, LONG_GAP_PERIODS * period_s)
        far.append(rows[first + left[is_far]])
        behind.append(rows[first + left[~is_far]])
    aside[FAR] = np.sort(np.concatenate(far))
    aside[BEHIND] = np.sort(np.concatenate(behind)) if behind else np.empty(0, dtype=np.intp)
    return Screened(out, {reason: found for reason, found in aside.items() if len(found)}, tuple(set_back))


def set_back_at(t: Array, reach: int = EPOCH_ROWS) -> list[int]:
    """Return the rows from which a clock runs that was set back: most after lie behind most before.

    Args:
        t: (n,) stamps, s.
        reach: Rows that are looked at before and after.
    """
    found: list[int] = []
    with np.errstate(invalid="ignore", over="ignore"):
        steps_back = np.flatnonzero(t[1:] < t[:-1]) + 1
    for k in steps_back.tolist():
        begun = found[-1] if found else 0
        if k - begun < reach or len(t) - k < reach or t[k + reach - 1] > t[k - 1]:
            continue
        if np.median(t[k : k + reach]) < np.median(t[k - reach : k]):
            found.append(k)
    return found


def _out_and_back(t: Array, period_s: float) -> NDArray[np.bool_]:
    """Return which rows lie far off while their neighbours go on from each other without them.

    A clock that was set back does not come to stand where it would have been: what follows a stretch of
    wild stamps does. A stretch is no longer than half of the table, nor full of jumps itself.
    """
    is_out = np.zeros(len(t), dtype=np.bool_)
    gap_s = LONG_GAP_PERIODS * period_s
    jumps = np.flatnonzero(np.abs(np.diff(t)) > gap_s) + 1
    begun = 0
    for place, first in enumerate(jumps.tolist()):
        if first <= begun:
            continue
        later = jumps[place + 1 : place + 1 + MOST_JUMPS]
        later = later[later - first < len(t) // 2]
        missed_s = t[later] - t[first - 1]
        goes_on = (missed_s > 0.0) & (missed_s <= (later - first + 1) * period_s + gap_s)
        if goes_on.any():
            begun = int(later[goes_on][0])
            is_out[first:begun] = True
    return is_out


def _rising(t: Array) -> NDArray[np.intp]:
    """Return the rows of the longest subsequence that strictly rises."""
    if len(t) < 2 or (np.diff(t) > 0.0).all():
        return np.arange(len(t))
    ends: list[float] = []  # the lowest end of a chain of each length, and its row
    rows: list[int] = []
    before = np.full(len(t), -1, dtype=np.intp)
    for k, value in enumerate(t.tolist()):
        length = bisect_left(ends, value)
        if length:
            before[k] = rows[length - 1]
        if length == len(ends):
            ends.append(value)
            rows.append(k)
        else:
            ends[length], rows[length] = value, k
    chain = [rows[-1]]
    while before[chain[-1]] >= 0:
        chain.append(int(before[chain[-1]]))
    return np.array(chain[::-1], dtype=np.intp)


def _unwitnessed(t: Array, period_s: float) -> NDArray[np.bool_]:
    """Return which of rising stamps stand alone behind a long gap; a short table is its own witness."""
    gaps = np.flatnonzero(np.diff(t) > max(LONG_GAP_S, LONG_GAP_PERIODS * period_s)) + 1
    lonely = np.zeros(len(t), dtype=np.bool_)
    if not len(gaps):
        return lonely
    for group in np.split(np.arange(len(t)), gaps):
        lonely[group] = len(group) < WITNESSES
    return lonely
