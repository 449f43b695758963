"""Turn rates and star headings for the delay's calibration, from a recording or a folder."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from calibration.flights import read_flight
from groundstation.data_sets.stamp_words import complaint_about_arrivals, notes_of
from groundstation.declarations.errors import UsageError
from groundstation.files.errors import FileError
from groundstation.files.number_tables import load_table
from groundstation.fusion.stamp_screen import repeated_rows, screen_stamps, spacing_of, stretches_of

Array = NDArray[np.float64]

GUESS_S = 0.05
"""Of the delay, where no rig states one."""
HOLE_S = 0.5
"""What the gyro turned in a longer hole is not known."""
SLOWEST_S = 0.5
"""Samples further apart cannot show a turn to and fro; or they are not stamped in seconds."""


@dataclass(frozen=True, slots=True, eq=False)
class Turns:
    """What ``delay_from_headings`` takes, times of one clock.

    Attributes:
        gyro_t_s: End of each sample's window.
        rate_rad_s: Turn rates.
        arrival_t_s: When each heading's picture arrived.
        heading_rad: Headings by the stars.
        guess_s: First guess of the delay: the rig's.
        files: What was read.
        notes: What of it was set aside, a sentence each.
    """

    gyro_t_s: Array
    rate_rad_s: Array
    arrival_t_s: Array
    heading_rad: Array
    guess_s: float
    files: tuple[Path, ...]
    notes: tuple[str, ...] = ()


def read_turns(source: Path, vehicle: str | None) -> Turns:
    """Read a recording of a rig with a star camera, or a folder with imu.csv and stars.csv.

    The fixes of a recording are stamped with arrival minus the rig's delay; it is added again.

    Args:
        source: Recording or folder.
        vehicle: Whose; None if the recording holds only one with a star camera.

    Raises:
        RecordingError: The recording cannot be read.
        UsageError: It has no such vehicle, or no samples or fixes of it.
        FileError: A file of the folder is missing or wrong.
    """
    if source.is_dir():
        files = source / "imu.csv", source / "stars.csv"
        table = load_table(files[0], ("t_s", "omega_rad_s"))
        gyro, lines = table.numbers, table.lines.tolist()
        stars = load_table(files[1], ("t_arrival_s", "heading_rad")).numbers
        spacing_s = spacing_of(gyro[:, 0])
        if not spacing_s < SLOWEST_S:
            raise FileError(f"{files[0]}: t_s rises by {spacing_s:g} from row to row: seconds are expected.")
        found = screen_stamps(gyro[:, 0], spacing_s, repeated_rows(gyro))
        if found.set_back:
            raise FileError(
                f"{files[0]}: line {lines[found.set_back[0][0]]}, the clock is set back by "
                f"{found.set_back[0][1]:.6g} s: give the part before or after it."
            )
        notes = notes_of(found, gyro[:, 0], lines, files[0].name)
        good = np.isfinite(found.stamp_s)
        complaint = complaint_about_arrivals(stars[:, 0], gyro[good, 0])
        if complaint is not None:
            raise FileError(f"{files[1]}: {complaint}.")
        once = np.unique(stars, axis=0)
        if len(once) < len(stars):
            notes = (*notes, f"{files[1].name}: {len(stars) - len(once)} of {len(stars)} rows came twice")
        t, rate = gyro[good].T
        return _longest(Turns(t, rate, once[:, 0], once[:, 1], GUESS_S, files, notes))
    data = read_flight(source, vehicle, rates_only=True)
    if not len(data.stars):
        raise UsageError(f"{source}: holds {len(data.imu)} IMU samples and no star fix.")
    delay_s = data.stamp_delay_s
    exposure_s, heading_rad = data.stars[:, 0], data.stars[:, 4]
    arrival_s = exposure_s + delay_s
    turns = Turns(data.imu[:, 0], data.imu[:, 1], arrival_s, heading_rad, delay_s, (source,), data.notes)
    return _longest(turns)


def _longest(turns: Turns) -> Turns:
    """Return the longest stretch without a hole in the gyro's samples."""
    stretches = stretches_of(turns.gyro_t_s, HOLE_S)
    rows = max(stretches, key=len)
    if len(stretches) == 1:
        return turns
    note = (
        f"the gyro's samples have {len(stretches) - 1} holes; the longest stretch is used, "
        f"{turns.gyro_t_s[rows[0]]:.6g} to {turns.gyro_t_s[rows[-1]]:.6g} s"
    )
    t, rate = turns.gyro_t_s[rows], turns.rate_rad_s[rows]
    return replace(turns, gyro_t_s=t, rate_rad_s=rate, notes=(*turns.notes, note))
