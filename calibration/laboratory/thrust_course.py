"""How thrust follows the coils, sampled at the polls of the IMU block.

A valve opens a while after its coil is energised and closes a while after it is released; one that is
released before it has opened never opens, one that is energised again before it has closed stays open. Thrust
then follows with one time constant, and is a little less for each further valve that is open.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from calibration.laboratory.coil_spans import CoilSpans
from drivers.valve_bus.messages import VALVES

Array = NDArray[np.float64]

POLL_S = 1e-3
CLOSING_DOUBT_S = 2e-4
"""A valve that is energised so near the moment of its closing may have stayed open."""


@dataclass(frozen=True, slots=True)
class Timing:
    """What all valves share.

    Attributes:
        open_s: From current to thrust.
        close_s: From no current to none.
        rise_s: Time constant of the thrust.
        sag: Factor of thrust per further open valve.
    """

    open_s: float
    close_s: float
    rise_s: float
    sag: float


@dataclass(frozen=True, slots=True, eq=False)
class Windows:
    """Averaging windows of the packets, in polls since the start of the course.

    Attributes:
        last: (n,) index of each window's last poll.
        polls: How many polls a window holds.
    """

    last: NDArray[np.intp]
    polls: int

    def mean(self, at_polls: Array) -> Array:
        """Mean (n, ...) over the windows of what was sampled at the polls (k, ...)."""
        total = np.concatenate([np.zeros((1, *at_polls.shape[1:])), np.cumsum(at_polls, axis=0)])
        found: Array = (total[self.last + 1] - total[self.last + 1 - self.polls]) / self.polls
        return found


@dataclass(frozen=True, slots=True, eq=False)
class Openings:
    """When valves were open, in polls.

    Attributes:
        valve: (p,) whose.
        begin, end: (p,) fractional polls.
        is_doubtful: (p,) whether the pulse was so short that it may not have opened at all.
        doubtful_spans: From and to, when nobody knows whether a valve was open.
    """

    valve: NDArray[np.intp]
    begin: Array
    end: Array
    is_doubtful: NDArray[np.bool_]
    doubtful_spans: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """Thrust of each valve over its full thrust.

    Attributes:
        share: (k, 8) at each poll.
        turned_s: (k, 8) integral of it over time up to the poll.
    """

    share: Array
    turned_s: Array


def openings(coils: CoilSpans, start: Array, stop: Array, timing: Timing, doubt_s: float) -> Openings:
    """Let the valves follow their coils.

    Args:
        coils: The coils.
        start: (p,) of their spans, in polls.
        stop: (p,) likewise.
        timing: Of the valves.
        doubt_s: A coil energised for the delay of opening give or take this may not have opened its valve.
    """
    found: list[tuple[int, float, float, bool]] = []
    spans: list[tuple[float, float]] = []
    margin, opens, closes = doubt_s / POLL_S, timing.open_s / POLL_S, timing.close_s / POLL_S
    for valve in range(VALVES):
        rows = np.flatnonzero(coils.valve == valve)
        open_until = -math.inf
        for first, last in zip(start[rows].tolist(), stop[rows].tolist(), strict=True):
            if abs(first - open_until) < CLOSING_DOUBT_S / POLL_S:
                spans.append((min(first, open_until), max(last, first + opens) + closes))
            if first < open_until:  # it was still open
                open_until = last + closes
                found[-1] = (valve, found[-1][1], open_until, found[-1][3])
                continue
            opened = first + opens
            if last < opened - margin:
                continue
            is_doubtful = last < opened + margin
            found.append((valve, opened, max(last + closes, opened), is_doubtful))
            if is_doubtful:
                spans.append((opened, found[-1][2]))
            open_until = last + closes if last > opened else -math.inf
    found.sort(key=lambda row: row[1])
    return Openings(
        np.array([row[0] for row in found], dtype=np.intp),
        np.array([row[1] for row in found], dtype=np.float64),
        np.array([row[2] for row in found], dtype=np.float64),
        np.array([row[3] for row in found], dtype=np.bool_),
        tuple(spans),
    )


def course(opened: Openings, timing: Timing, polls: int, jitter_s: float = 0.0) -> Course:
    """Return the thrust at polls 0 to ``polls`` - 1; doubtful openings count as none.

    The response to an edge is exact wherever between two polls it lies; only the sag takes each millisecond
    as a whole.
    An opening is the mean of one that is early and one that is late by its scatter ``jitter_s``: else the
    scatter would be taken for a slower rise.
    """
    ticks = np.arange(-1.0, polls)
    shares, pushed = np.zeros((polls, VALVES)), np.zeros((polls, VALVES))
    left = kept_of(timing.rise_s)
    for valve in range(VALVES):
        rows = np.flatnonzero((opened.valve == valve) & ~opened.is_doubtful)
        if not len(rows):
            continue
        end = opened.end[rows]
        for late in (-jitter_s, jitter_s):
            begin = np.minimum(opened.begin[rows] + late / POLL_S, end)
            edges = np.column_stack([begin, end]).ravel()
            open_for = np.column_stack([np.zeros(len(rows)), end - begin]).ravel()
            shares[:, valve] += 0.5 * np.diff(np.interp(ticks, edges, np.cumsum(open_for)))
            for edge, sign in ((begin, 0.5), (end, -0.5)):
                inside = edge[(edge > 0.0) & (edge < polls - 1)]
                cell = np.ceil(inside).astype(np.intp)
                rest = cell - inside
                np.add.at(pushed[:, valve], cell, sign * ((1.0 - left**rest) - (1.0 - left) * rest))
        pushed[:, valve] += (1.0 - left) * shares[:, valve]
    factor = timing.sag ** np.maximum(0.0, shares.sum(axis=1, keepdims=True) - 1.0)
    share = np.asarray(lfilter([1.0], [1.0, -left], pushed * factor, axis=0))
    # what flows through a first-order lag is what came in less what is still in it
    turned = np.cumsum(shares * factor, axis=0) * POLL_S - timing.rise_s * share
    return Course(share, turned)


def kept_of(time_constant_s: float) -> float:
    """What a first-order lag keeps from poll to poll."""
    return math.exp(-POLL_S / time_constant_s) if time_constant_s > 0.0 else 0.0


def lagged(at_polls: Array, time_constant_s: float) -> Array:
    """What a sensor with a first-order low-pass makes of (k, ...)."""
    left = kept_of(time_constant_s)
    if left == 0.0:
        return at_polls
    state = left * at_polls[:1]
    found, _ = lfilter([1.0 - left], [1.0, -left], at_polls, axis=0, zi=state)
    return np.asarray(found)
