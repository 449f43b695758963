"""Which channels of a rest are alive: one that is stuck or saturated has no mean, slope or noise to give."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.imu.everyday_units import G_M_S2
from calibration.imu.zero_offset import packet_sigma
from calibration.outcome import CalibrationRefusedError
from groundstation.fusion.noise import NoiseModel

Array = NDArray[np.float64]

UNITS: Mapping[str, str] = {"omega": "rad/s", "ax": "m/s^2", "ay": "m/s^2"}
"""The channels in their order, with their units."""
MOST_EQUAL = 0.9
"""A larger share of packets with one and the same reading is a stuck channel, or steps beyond its noise."""
MOST_AT_THE_END = 0.02
LEAST_FOR_UNITS = 64
"""Packets by whose noise a unit is told."""
STUCK_PACKETS = 100
"""In a row with one and the same reading: noise changes it sooner, be its steps as coarse as they may."""
HEAPED = 1.5
"""At a limit packets heap up: more than at the reading beside it, by this factor; noise thins out."""
OTHER_UNITS: Mapping[str, Mapping[str, float]] = {
    "rad/s": {"deg/s": math.degrees(1.0)},
    "m/s^2": {"mg": 1e3 / G_M_S2, "g": 1.0 / G_M_S2},
}
"""By how much a channel's noise is larger than stated where it is in another unit."""
UNIT_TOLERANCE = 0.2


@dataclass(frozen=True, slots=True)
class Alive:
    """Channels that can be used, by name, and why the others cannot, a sentence each."""

    names: tuple[str, ...]
    columns: tuple[int, ...]
    complaints: tuple[str, ...]


def alive_channels(readings: Array, noise: NoiseModel) -> Alive:
    """Judge the channels of a rest.

    Args:
        readings: (n, 3) rate rad/s, ax, ay m/s^2.
        noise: As rig or folder state it.

    Raises:
        CalibrationRefusedError: None is alive.
    """
    density = (noise.gyro_density_rad_s_rthz, *2 * (noise.acc_density_m_s2_rthz,))
    stated_sigma = [each / math.sqrt(noise.packet_period_s) for each in density]
    found = [
        complaint_about(readings[:, k]) or complaint_about_unit(readings[:, k], unit, stated_sigma[k])
        for k, unit in enumerate(UNITS.values())
    ]
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


def complaint_about_unit(values: Array, unit: str, stated_sigma: float) -> str | None:
    """Return why the noise of a channel (n,) at rest is that of another unit; None if it is not."""
    known = values[np.isfinite(values)]
    if len(known) < LEAST_FOR_UNITS or not stated_sigma > 0.0:
        return None
    ratio = float(packet_sigma(known[:, None])[0]) / stated_sigma
    for other, factor in OTHER_UNITS[unit].items():
        if abs(ratio / factor - 1.0) < UNIT_TOLERANCE:
            return (
                f"is {ratio:.3g} times as noisy as rig or meta.json state, as if it were in {other}: {unit} "
                "is expected, or its true noise there"
            )
    return None


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"
