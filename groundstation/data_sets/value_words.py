"""What is wrong with the values of a folder's tables, in a sentence: lengths in mm, no temperatures."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from groundstation.fusion.noise import NoiseModel

Array = NDArray[np.float64]

WIDEST_TABLE_M = 50.0
"""From the middle of the table frame; no vehicle glides farther away."""
CHIP_C = (-60.0, 150.0)
"""What a sensor can report of itself, with room."""
NAMED = 3
LEAST_PACKETS = 20
MOST_WILD = 0.3
"""Share of packets that are no readings of a channel; with more it is dead, or in another unit."""
MOST_EQUAL = 0.5
"""Share of fixes with one value in a column."""
LEAST_FIXES = 6
POSE = ("x_m", "y_m", "heading_rad")
MOST_SCATTER = 20.0
"""Times by which the scatter of resting fixes may differ from what is stated of it."""
TINY = 1e-12
SCATTER_TOLERANCE = 1.8
"""Times by which a healthy sensor's scatter may differ from what is stated of it."""
STANDARD_GRAVITY_M_S2 = 9.80665
_ACC_UNITS = {1e3 / STANDARD_GRAVITY_M_S2: "mg", 1e3: "mm/s^2"}
CHANNELS: Mapping[int, tuple[str, str, Mapping[float, str]]] = {
    1: ("omega_rad_s", "Radians a second", {math.degrees(1.0): "deg/s", math.degrees(3600.0): "deg/h"}),
    2: ("ax_m_s2", "Metres a second squared", _ACC_UNITS),
    3: ("ay_m_s2", "Metres a second squared", _ACC_UNITS),
}
"""By column of the packets: name, unit, and other units with how many of them are one."""
DENSITY_OF: Mapping[int, Callable[[NoiseModel], float]] = {
    1: lambda noise: noise.gyro_density_rad_s_rthz,
    2: lambda noise: noise.acc_density_m_s2_rthz,
    3: lambda noise: noise.acc_density_m_s2_rthz,
}


def complaint_about_places(stars: Array) -> str | None:
    """Return why the fixes' places cannot be metres; None if they can.

    Args:
        stars: (m, 5) exposure, arrival, x, y, heading.
    """
    places = np.abs(stars[:, 2:4]).max(axis=1, initial=0.0)
    places = places[np.isfinite(places)]
    if not len(places) or float(np.median(places)) <= WIDEST_TABLE_M:
        return None
    return (
        f"x_m and y_m are {np.median(places):.4g} in the middle, farther than any table reaches: in mm or "
        "cm? Metres are expected"
    )


def complaint_about_readings(imu: Array, noise: NoiseModel) -> str | None:
    """Return why rates or accelerations cannot be in SI units; None if they can.

    How far readings scatter from packet to packet is known, whatever the vehicle does: in other units it is
    the wrong number of times that.

    Args:
        imu: (n, 5) stamp, rate, ax, ay, temperature, as given.
        noise: As the folder states it.
    """
    for column, (name, expected, units) in CHANNELS.items():
        times = _scatter(imu[:, column]) / (DENSITY_OF[column](noise) / math.sqrt(noise.packet_period_s))
        for factor, unit in units.items():
            if abs(math.log(max(times, TINY) / factor)) < math.log(SCATTER_TOLERANCE):
                return (
                    f"{name} scatters {times:.3g} times as much from packet to packet as the noise in the "
                    f"known block of meta.json: in {unit}? {expected} are expected"
                )
    return None


def complaint_about_dead_channels(imu: Array, noise: NoiseModel) -> str | None:
    """Return which channel gives no readings; None if all of them mostly do.

    Args:
        imu: (n, 5) stamp, rate, ax, ay, temperature, as given.
        noise: Says where the sensors' scales end.
    """
    for column, (name, _, _) in CHANNELS.items():
        most = noise.full_scale_rad_s if column == 1 else noise.full_scale_m_s2
        with np.errstate(invalid="ignore"):
            wild = 1.0 - float((np.abs(imu[:, column]) <= most).mean())
        if wild > MOST_WILD:
            return (
                f"{name} is no number, or beyond the {most:g} at which the sensor's scale ends, in "
                f"{100.0 * wild:.0f} % of the packets: nothing can be estimated without it"
            )
    return None


def complaint_about_columns(stars: Array) -> str | None:
    """Return which column of the fixes is none, or stands still while others move; None if all can be read.

    Args:
        stars: (m, 5) exposure, arrival, x, y, heading.
    """
    if len(stars) < LEAST_FIXES:
        return None
    shares = {}
    for name, values in zip(("t_exposure_s", "t_arrival_s", *POSE), stars.T, strict=True):
        known = values[np.isfinite(values)]
        if len(known) < MOST_EQUAL * len(values):
            return f"{name} is no number in {len(values) - len(known)} of {len(values)} rows"
        shares[name] = float(np.unique(known, return_counts=True)[1].max()) / len(values)
    for name, share in shares.items():
        if share > MOST_EQUAL > min(shares[each] for each in (POSE if name in POSE else shares)):
            return f"{name} is the same in {100.0 * share:.0f} % of the rows, though others change: frozen"
    return None


def complaint_about_scatter(stars: Array, run_start_s: float, noise: NoiseModel) -> str | None:
    """Return why the places of the resting fixes contradict their stated sigma; None if they do not.

    Args:
        stars: (m, 5) exposure, arrival, x, y, heading.
        run_start_s: Until then the vehicle rests, as the folder states it.
        noise: Likewise.
    """
    rest = stars[(stars[:, 0] <= run_start_s) & np.isfinite(stars).all(axis=1)]
    if len(rest) < LEAST_FIXES:
        return None
    sigma_m = noise.star_sigma_xy_m
    off_m = np.abs(rest[:, 2:4] - np.median(rest[:, 2:4], axis=0))
    scatter_m = 1.4826 * float(np.median(off_m, axis=0).max())
    text = (
        f"the {len(rest)} fixes of the rest, until known.run_start_s = {run_start_s:g}, scatter by "
        f"{scatter_m:.2g} m, but known.star_sigma_xy_m of meta.json is {sigma_m:g}"
    )
    if scatter_m > MOST_SCATTER * sigma_m:
        return f"{text}: one of them is in another unit, or the vehicle did not rest"
    if 0.0 < scatter_m < sigma_m / MOST_SCATTER:
        return f"{text}: one of them is in another unit"
    return None


def notes_of_still_channels(imu: Array, name: str) -> tuple[str, ...]:
    """Return a sentence for each channel that has one value in all packets: it measures nothing.

    Args:
        imu: (n, 5) stamp, rate, ax, ay, temperature, as given.
        name: Of the file.
    """
    if len(imu) < LEAST_PACKETS:
        return ()
    return tuple(
        f"{name}: {channel} is {imu[0, column]:.6g} in all {len(imu)} packets: that channel measures nothing"
        for column, (channel, _, _) in CHANNELS.items()
        if (imu[:, column] == imu[0, column]).all()
    )


def _scatter(readings: Array) -> float:
    """Standard deviation of the readings by how they differ from packet to packet, robust against motion."""
    with np.errstate(invalid="ignore", over="ignore"):
        steps = np.abs(np.diff(readings))
    steps = steps[np.isfinite(steps)]
    return float(np.median(steps)) * 1.4826 / math.sqrt(2.0) if len(steps) >= LEAST_PACKETS else math.nan


def complaint_about_temperatures(temperature_c: Array) -> str | None:
    """Return why most temperatures cannot be degrees Celsius; None if they can, or if there are none."""
    known = temperature_c[np.isfinite(temperature_c)]
    if not len(known) or CHIP_C[0] <= float(np.median(known)) <= CHIP_C[1]:
        return None
    return (
        f"temperature_C is {np.median(known):.4g} in the middle, and no chip is so warm or cold: degrees "
        "Celsius are expected"
    )


def without_wild_temperatures(
    temperature_c: Array, lines: Sequence[int], name: str
) -> tuple[Array, tuple[str, ...]]:
    """Return the temperatures with NaN for those that no chip can have, and a sentence about these.

    Args:
        temperature_c: (n,) as given.
        lines: Of the rows, in their file.
        name: Of the file.
    """
    wild = np.flatnonzero((temperature_c < CHIP_C[0]) | (temperature_c > CHIP_C[1]))
    if not len(wild):
        return temperature_c, ()
    kept = temperature_c.copy()
    kept[wild] = np.nan
    where = ", ".join(f"{lines[row]} ({temperature_c[row]:.6g})" for row in wild[:NAMED].tolist())
    more = f" and {len(wild) - NAMED} more" if len(wild) > NAMED else ""
    word = "lines" if len(wild) > 1 else "line"
    return kept, (
        f"{name}: {len(wild)} of {len(kept)} temperatures set aside, temperature_C is none of a chip: {word} "
        f"{where}{more}",
    )
