"""Which channels of a rest are alive: one that is stuck or saturated has no mean, slope or noise to give."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.outcome import CalibrationRefusedError

Array = NDArray[np.float64]

UNITS: Mapping[str, str] = {"omega": "rad/s", "ax": "m/s^2", "ay": "m/s^2"}
"""The channels in their order, with their units."""
MOST_EQUAL = 0.9
"""A larger share of packets with one and the same reading is a stuck channel, or steps beyond its noise."""
MOST_AT_THE_END = 0.02
STUCK_PACKETS = 100
"""In a row with one and the same reading: noise changes it sooner, be its steps as coarse as they may."""
HEAPED = 1.5
"""At a limit packets heap up: more than at the reading beside it, by this factor; noise thins out."""


@dataclass(frozen=True, slots=True)
class Alive:
    """Channels that can be used, by name, and why the others cannot, a sentence each."""

    names: tuple[str, ...]
    columns: tuple[int, ...]
    complaints: tuple[str, ...]


def alive_channels(readings: Array) -> Alive:
    """Judge the channels of a rest.

    Args:
        readings: (n, 3) rate rad/s, ax, ay m/s^2.

    Raises:
        CalibrationRefusedError: None is alive.
    """
    found = [complaint_about(readings[:, k]) for k in range(len(UNITS))]
    words = tuple(f"{name} {each}" for name, each in zip(UNITS, found, strict=True) if each is not None)
    good = [k for k, each in enumerate(found) if each is None]
    if not good:
        raise CalibrationRefusedError("; ".join(words))
    left_out = tuple(f"{each}: it is left out" for each in words)
    return Alive(tuple(list(UNITS)[k] for k in good), tuple(good), left_out)


def complaint_about(values: Array) -> str | None:
    """Return why a channel (n,) is not alive; None if it is, or has too few readings to tell."""
    known = values[np.isfinite(values)]
    if len(known) < 0.5 * len(values):
        return f"is no number in {_percent(1.0 - len(known) / len(values))} of the packets"
    if len(known) < 8:
        return None
    level, count = np.unique(known, return_counts=True)
    share = float(count.max() / len(known))
    if share > MOST_EQUAL:
        stuck = float(level[count.argmax()])
        why = "not connected?" if stuck == 0.0 else "stuck, saturated, or its steps are larger than its noise"
        return f"reads {stuck:.6g} in {_percent(share)} of the packets: {why}"
    longest = int(np.diff(np.flatnonzero(np.diff(known, prepend=np.nan, append=np.nan) != 0.0)).max())
    if longest >= STUCK_PACKETS:
        return f"was stuck: it has the same reading in {longest} packets in a row"
    for end, beside in ((-1, -2), (0, 1)):
        if count[end] > MOST_AT_THE_END * len(known) and count[end] > HEAPED * count[beside]:
            return (
                f"is saturated: at the end of its scale, {level[end]:.6g}, in "
                f"{_percent(count[end] / len(known))} of the packets"
            )
    return None


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"
