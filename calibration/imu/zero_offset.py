"""Zero offsets from a rest, after a test that the rest was one.

The mean of a rest is worth nothing if somebody leant on the table. Blocks of a quarter second whose mean lies
further from the others than the packets' own noise allows are named and cut out; so are single wild packets.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.outcome import CalibrationRefusedError

Array = NDArray[np.float64]

BLOCK_S = 0.25
BLOCK_SIGMAS = 6.0
"""A block's mean this many of its sigmas away is a disturbance; one in 10^8 by chance."""
MAX_WANDER = 3.0
"""Blocks that spread wider than this times their white noise are moved, not wandering."""
WILD_SIGMAS = 9.0
LONGEST_KNOCK_S = 0.5
"""What rings off faster is a valve or a knock on the table, what lasts longer a hand."""
LEAST_SHARE = 0.5
"""If less than this was undisturbed, it was no rest."""
MARGIN_BLOCKS = 1
CHANNELS = ("omega", "ax", "ay")


class NotARest(CalibrationRefusedError):  # noqa: N818 - it is a finding about the recording
    """The recording does not hold a rest; the text states what was found."""


@dataclass(frozen=True, slots=True)
class Disturbance:
    """A stretch that was cut out."""

    start_s: float
    end_s: float
    kind: str
    """wild packet, knock or touch."""
    channel: str
    size: float
    """Largest departure from the rest's mean, in the channel's unit."""


@dataclass(frozen=True, slots=True, eq=False)
class ZeroOffset:
    """Offsets of rate rad/s, ax and ay m/s^2 at rest; on a slope the accelerometers' hold its gravity."""

    mean: Array
    """(c,) of the channels that were given."""
    mean_sigma: Array
    """(c,) of the mean: white noise, and the wandering seen between blocks."""
    packet_sigma: Array
    """(c,) of one packet."""
    temperature_c: float
    packets: int
    duration_s: float
    disturbances: tuple[Disturbance, ...]


def zero_offset(
    t_s: Array, readings: Array, temperature_c: Array, channels: Sequence[str] = CHANNELS
) -> ZeroOffset:
    """Return the mean of the undisturbed part of a rest.

    Args:
        t_s: (n,) stamps, ascending.
        readings: (n, c) rate rad/s, ax, ay m/s^2, or those of them that are alive.
        temperature_c: (n,), NaN where unknown.
        channels: Names of the c.

    Raises:
        NotARest: too short, or disturbed for more than half of the time.
    """
    n = len(t_s)
    period = float(np.median(np.diff(t_s))) if n > 1 else math.nan
    size = max(4, round(BLOCK_S / period)) if n > 1 and period > 0.0 else 4
    if n < 4 * size:
        raise NotARest(f"a rest of {4 * BLOCK_S:g} s or more is needed, found {n} packets")
    sigma = packet_sigma(readings)
    median = np.median(readings, axis=0)
    blocks = np.arange(n) // size
    is_wild = _wild(readings, median, sigma)
    found = _jumps(t_s, readings, median, sigma, is_wild, channels)
    count = int(blocks[-1]) + 1
    sums = np.array(
        [np.bincount(blocks, np.where(is_wild, 0.0, readings[:, c]), count) for c in range(len(channels))]
    ).T
    weight = np.bincount(blocks, ~is_wild, count)
    means = sums / np.maximum(weight, 1)[:, None]
    centre = np.median(means, axis=0)
    # a real offset wanders a little; its own robust spread is allowed, up to a point
    wander = 1.4826 * np.median(np.abs(means - centre), axis=0)
    white = sigma / np.sqrt(size)
    limit = BLOCK_SIGMAS * np.clip(wander, white, MAX_WANDER * white)
    is_bad = (np.abs(means - centre) > limit).any(axis=1) | (weight < size / 4)
    found += _disturbances(
        t_s, np.where(is_wild[:, None], np.nan, readings), blocks, is_bad, centre, limit, channels
    )
    for k in range(1, MARGIN_BLOCKS + 1):
        wide = is_bad.copy()
        wide[k:] |= is_bad[:-k]
        wide[:-k] |= is_bad[k:]
        is_bad = wide
    good = ~is_bad[blocks] & ~is_wild
    if good.sum() < LEAST_SHARE * n:
        kinds = ", ".join(sorted({d.kind for d in found}))
        raise NotARest(
            f"only {100 * good.mean():.0f} % of {t_s[-1] - t_s[0]:.1f} s was undisturbed ({kinds})"
        )
    kept = readings[good]
    steady = means[~is_bad]
    between = steady.std(axis=0, ddof=1) / math.sqrt(len(steady))
    mean_sigma = np.maximum(sigma / math.sqrt(len(kept)), between)
    known = temperature_c[good][np.isfinite(temperature_c[good])]
    warmth = float(known.mean()) if len(known) else math.nan
    found.sort(key=lambda d: d.start_s)
    return ZeroOffset(
        kept.mean(axis=0), mean_sigma, sigma, warmth, len(kept), float(t_s[-1] - t_s[0]), tuple(found)
    )


def packet_sigma(readings: Array) -> Array:
    """Return the white noise of a packet from first differences, deaf to drift and to wild packets.

    The median alone would be fooled by quantisation, where most differences may be the same few steps.
    """
    steps = np.abs(np.diff(readings, axis=0))
    limit = 6.0 * np.maximum(1.4826 * np.median(steps, axis=0), np.percentile(steps, 70, axis=0))
    return np.array(
        [math.sqrt(float(np.mean(s[s <= top] ** 2)) / 2.0) for s, top in zip(steps.T, limit, strict=True)]
    )


def _wild(readings: Array, median: Array, sigma: Array) -> NDArray[np.bool_]:
    """Return (n,) packets, alone or two in a row, that jump away and back; and those that are no numbers."""
    calm: NDArray[np.bool_] = np.asarray((np.abs(readings - median) < WILD_SIGMAS * sigma).all(axis=1))
    edge = np.ones(1, dtype=np.bool_)
    before = np.concatenate([edge, calm[:-1]])
    after = np.concatenate([calm[1:], edge])
    second_after = np.concatenate([calm[2:], edge, edge])
    second_before = np.concatenate([edge, edge, calm[:-2]])
    lonely = ~calm & ((before & (after | second_after)) | (after & second_before))
    result: NDArray[np.bool_] = lonely | ~np.isfinite(readings).all(axis=1)
    return result


def _jumps(
    t_s: Array,
    readings: Array,
    median: Array,
    sigma: Array,
    is_wild: NDArray[np.bool_],
    channels: Sequence[str],
) -> list[Disturbance]:
    """Name the packets that jump away and back: one alone is wild, two in a row were knocked."""
    out = []
    rows = np.nonzero(is_wild)[0]
    for run in np.split(rows, np.nonzero(np.diff(rows) > 1)[0] + 1) if len(rows) else []:
        off = np.abs(readings[run] - median)
        channel = int(np.argmax(np.max(off / np.maximum(sigma, 1e-300), axis=0)))
        kind = "wild packet" if len(run) == 1 else "knock"
        start, end = float(t_s[run[0]]), float(t_s[run[-1]])
        out.append(Disturbance(start, end, kind, channels[channel], float(np.max(off[:, channel]))))
    return out


def _disturbances(
    t_s: Array,
    readings: Array,
    blocks: NDArray[np.intp],
    is_bad: NDArray[np.bool_],
    centre: Array,
    limit: Array,
    channels: Sequence[str],
) -> list[Disturbance]:
    """Join neighbouring disturbed blocks and name each stretch; wild packets are NaN in `readings`."""
    edges = np.diff(np.concatenate([[0], is_bad.astype(int), [0]]))
    out = []
    for first, last in zip(np.nonzero(edges == 1)[0], np.nonzero(edges == -1)[0], strict=True):
        rows = (blocks >= first) & (blocks < last)
        off = np.abs(readings[rows] - centre)
        if np.isnan(off).all():
            continue  # nothing but wild packets, which are named already
        channel = int(np.argmax(np.nanmax(off / limit, axis=0)))
        start, end = float(t_s[rows][0]), float(t_s[rows][-1])
        kind = "knock" if end - start <= LONGEST_KNOCK_S else "touch"
        out.append(Disturbance(start, end, kind, channels[channel], float(np.nanmax(off[:, channel]))))
    return out
