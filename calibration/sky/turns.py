"""Turn rates and star headings for the delay's calibration, from a recording or a folder."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from calibration.flights import read_flight
from groundstation.declarations.errors import UsageError
from groundstation.files.number_tables import load_table

Array = NDArray[np.float64]

GUESS_S = 0.05
"""Of the delay, where no rig states one."""


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
    """

    gyro_t_s: Array
    rate_rad_s: Array
    arrival_t_s: Array
    heading_rad: Array
    guess_s: float
    files: tuple[Path, ...]


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
        gyro = load_table(files[0], ("t_s", "omega_rad_s")).numbers
        stars = load_table(files[1], ("t_arrival_s", "heading_rad")).numbers
        return Turns(gyro[:, 0], gyro[:, 1], stars[:, 0], stars[:, 1], GUESS_S, files)
    data = read_flight(source, vehicle, rates_only=True)
    if not len(data.stars):
        raise UsageError(f"{source}: holds {len(data.imu)} IMU samples and no star fix.")
    delay_s = data.stamp_delay_s
    exposure_s, heading_rad = data.stars[:, 0], data.stars[:, 4]
    return Turns(data.imu[:, 0], data.imu[:, 1], exposure_s + delay_s, heading_rad, delay_s, (source,))
