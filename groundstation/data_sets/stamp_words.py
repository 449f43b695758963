"""What is wrong with the stamps of a folder's tables, in a sentence: units, rate, bunches, wild rows."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from groundstation.fusion.flight_data import EARLY_S
from groundstation.fusion.stamp_screen import (
    BEHIND,
    FAR,
    LONG_GAP_S,
    NOT_FINITE,
    REPEATED,
    Screened,
    spacing_of,
)

Array = NDArray[np.float64]

UNITS = {1e3: "milliseconds", 1e6: "microseconds", 1e9: "nanoseconds"}
UNIT_TOLERANCE = 0.2
RATE_TOLERANCE = 0.008
"""A ceramic resonator is 0.5 % off; windows that are counted by a rate further off are counted wrong."""
LEAST_ROWS = 20
LEAST_SINGLE = 0.25
"""Share of the rows that follow on the one before; below, most packets would have been lost."""
MOST_EQUAL = 0.1
MOST_FALLING = 0.1
LATEST_START = 1.0
"""The record begins before this many of its durations have passed."""
MOST_EARLY = 0.5
SPANNED = 0.05
"""Share of the record that fixes span at least: by it other units are told from another clock."""
NAMED = 3
ASIDE_WORDS = {
    NOT_FINITE: "is no number",
    FAR: "is far from the rows around it",
    BEHIND: "is not after the one before",
    REPEATED: "and all readings are those of an earlier line",
}


def complaint_about_order(stamp_s: Array) -> str | None:
    """Return why the rows are not in the order of time; None if they are, but for some."""
    falling = float((np.diff(stamp_s) < 0.0).mean()) if len(stamp_s) > LEAST_ROWS else 0.0
    if falling <= MOST_FALLING:
        return None
    return f"t_s falls in {100.0 * falling:.0f} % of the rows: sort them by time, the oldest first"


def complaint_about_units(stamp_s: Array, period_s: float) -> str | None:
    """Return why the stamps of packets, as given, cannot be seconds or ends of windows; None if they can.

    Args:
        stamp_s: (n,).
        period_s: As the folder states it.
    """
    spacing = spacing_of(stamp_s)
    for factor, unit in UNITS.items():
        if abs(spacing / period_s / factor - 1.0) < UNIT_TOLERANCE:
            return (
                f"t_s rises by {spacing:g} from packet to packet, {factor:g} times what known.imu_rate_hz = "
                f"{1.0 / period_s:g} means: {unit}? Seconds are expected"
            )
    return None


def complaint_about_bunches(imu: Array, period_s: float) -> str | None:
    """Return why the stamps are those of deliveries, several packets each; None if they are not.

    Args:
        imu: (n, 5) as given.
        period_s: As the folder states it.
    """
    if len(imu) < LEAST_ROWS:
        return None
    same = np.diff(imu[:, 0]) == 0.0
    other = same & (imu[1:, 1:] != imu[:-1, 1:]).any(axis=1)
    if other.mean() <= MOST_EQUAL:
        return None
    size = 1.0 / max(1.0 - float(other.mean()), 1.0 / len(imu))
    return (
        f"about {size:.0f} packets in a row share a stamp, though their readings differ: it is that of their "
        f"delivery; give each the end of its window, {1e3 * period_s:g} ms apart"
    )


def complaint_about_rate(screened_s: Array, period_s: float) -> str | None:
    """Return how the packets' spacing contradicts the stated rate; None if it does not.

    Args:
        screened_s: (n,) after the screen.
        period_s: As the folder states it.
    """
    t = screened_s[np.isfinite(screened_s)]
    if len(t) < LEAST_ROWS:
        return None
    steps = np.diff(t)
    windows = np.maximum(np.round(steps / period_s), 1.0)
    is_single = windows == 1.0
    near = windows <= 3.0
    ratio = float(steps[near].sum() / windows[near].sum() / period_s) if near.any() else math.inf
    if is_single.mean() >= LEAST_SINGLE and abs(ratio - 1.0) <= RATE_TOLERANCE:
        return None
    spacing = spacing_of(t)
    stated = f"known.imu_rate_hz of meta.json is {1.0 / period_s:g}, one each {1e3 * period_s:g} ms"
    in_all = float(steps[steps < 1.0].sum()) / max(1, int((steps < 1.0).sum()))
    if abs(in_all / period_s - 1.0) < UNIT_TOLERANCE and abs(spacing / in_all - 1.0) > UNIT_TOLERANCE:
        return (
            f"the packets come in bunches, most {1e3 * spacing:.3g} ms apart, in all {1e3 * in_all:.3g} ms; "
            f"{stated}: stamps of deliveries; give each packet the end of its window"
        )
    found = ratio * period_s if is_single.mean() >= LEAST_SINGLE else spacing
    return (
        f"the packets are {1e3 * found:.4g} ms apart ({1.0 / found:.4g} a second), but {stated}: correct it"
    )


def complaint_about_start(screened_s: Array, duration_s: float) -> str | None:
    """Return why the record does not count from the start of the run; None if it does."""
    t = screened_s[np.isfinite(screened_s)]
    if not len(t):
        return "no stamp in t_s is one of a clock that runs"
    if abs(float(t[0])) <= LATEST_START * duration_s + 1.0:
        return None
    unix = " (Unix time?)" if 1e9 < t[0] < 3e9 else ""
    return (
        f"t_s begins at {t[0]:.10g}{unix}, but known.run_start_s and known.duration_s = {duration_s:g} count "
        "from the start of the run: take the first stamp off all, in stars.csv, too"
    )


def complaint_about_fixes(stars: Array, screened_s: Array) -> str | None:
    """Return why no fix can belong to the packets; None if some can.

    Args:
        stars: (m, 5) exposure, arrival, ...
        screened_s: (n,) of the packets, after the screen.
    """
    early = stars[:, 1] < stars[:, 0] - EARLY_S
    if early.sum() > MOST_EARLY * len(stars):
        return (
            f"t_arrival_s is before t_exposure_s in {early.sum()} of {len(stars)} rows: a fix arrives after "
            "its exposure; are the columns interchanged"
        )
    return complaint_about_arrivals(stars[:, 0], screened_s, "t_exposure_s") or complaint_about_arrivals(
        stars[:, 1], screened_s
    )


def complaint_about_arrivals(given_s: Array, screened_s: Array, name: str = "t_arrival_s") -> str | None:
    """Return why no stamp of a column (m,) can belong to the packets; None if some can."""
    t = screened_s[np.isfinite(screened_s)]
    given = given_s[np.isfinite(given_s)]
    if len(given) < 2 or not len(t) or ((given > t[0] - 5.0) & (given < t[-1] + 5.0)).any():
        return None
    text = (
        f"no {name} lies within the packets' times, {t[0]:.6g} to {t[-1]:.6g} s: they run from "
        f"{given.min():.10g} to {given.max():.10g}"
    )
    for factor, unit in UNITS.items():
        span_s = float(np.ptp(given)) / factor
        if t[0] - 5.0 < float(np.median(given)) / factor < t[-1] + 5.0 and span_s > SPANNED * np.ptp(t):
            return f"{text}; in {unit}? Seconds of the packets' clock are expected"
    return f"{text}; by another clock? Seconds of the packets' clock are expected"


def notes_of(found: Screened, given_s: Array, lines: Sequence[int], name: str) -> tuple[str, ...]:
    """Return a sentence for every reason for which rows were set aside, the first of them named by line."""
    notes = []
    for reason, rows in found.aside.items():
        where = ", ".join(f"{lines[row]} ({given_s[row]:.10g})" for row in rows[:NAMED].tolist())
        more = f" and {len(rows) - NAMED} more" if len(rows) > NAMED else ""
        word = "lines" if len(rows) > 1 else "line"
        notes.append(
            f"{name}: {len(rows)} of {len(given_s)} packets set aside, t_s {ASIDE_WORDS[reason]}: {word} "
            f"{where}{more}"
        )
    for row, back_s in found.set_back[:NAMED]:
        notes.append(
            f"{name}: line {lines[row]}, the clock is set back by {back_s:.6g} s; "
            + (
                "another session? Nothing is carried over from the one before"
                if row in found.starts
                else "seconds are counted on"
            )
        )
    return tuple(notes)


def note_of_rest(screened_s: Array, run_start_s: float, name: str) -> tuple[str, ...]:
    """Return a sentence where the end of the rest falls into a hole: what lies behind it is no rest."""
    t = screened_s[np.isfinite(screened_s)]
    before, after = t[t <= run_start_s], t[t > run_start_s]
    if not len(before) or not len(after) or after[0] - before[-1] <= LONG_GAP_S:
        return ()
    return (
        f"{name}: {after[0] - before[-1]:.6g} s are missing where known.run_start_s = {run_start_s:g} ends "
        f"the rest: the {len(after)} packets behind do not count as one",
    )
