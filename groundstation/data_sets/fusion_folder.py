"""The folder of a fusion data set: imu.csv, stars.csv and the `known` block of meta.json."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from groundstation.data_sets.known_block import read_known
from groundstation.data_sets.stamp_words import (
    complaint_about_bunches,
    complaint_about_fixes,
    complaint_about_order,
    complaint_about_rate,
    complaint_about_start,
    complaint_about_units,
    note_of_rest,
    notes_of,
)
from groundstation.data_sets.value_words import (
    complaint_about_columns,
    complaint_about_dead_channels,
    complaint_about_places,
    complaint_about_readings,
    complaint_about_scatter,
    complaint_about_temperatures,
    notes_of_still_channels,
    without_wild_temperatures,
)
from groundstation.files.errors import FileError
from groundstation.files.number_tables import load_table
from groundstation.fusion.flight_data import FlightData
from groundstation.fusion.noise import (
    GYRO_BIAS_WALK_RAD_S_RTS,
    NoiseModel,
    lag_of_bandwidth,
    packet_density,
    rounding_walk,
)

IMU_COLUMNS = ("t_s", "omega_rad_s", "ax_m_s2", "ay_m_s2", "temperature_C")
STAR_COLUMNS = ("t_exposure_s", "t_arrival_s", "x_m", "y_m", "heading_rad")
FIX_TIME_POLLS = 1.0
"""How well an exposure's stamp can be laid on the packets: nothing happens between two polls of the sensors.
Data sets do not give it; live, the clock's own sigma goes into each fix's covariance instead."""
FIX_DELAY_POLLS = 0.5
"""The constant part of it: what the best calibration of a camera's delay leaves."""


def read_folder(folder: Path, *, with_stars: bool = True) -> FlightData:
    """Read imu.csv, stars.csv and the `known` block of meta.json.

    Raises:
        FileError: A file, column, key or value is missing or wrong.
    """
    if not folder.is_dir():
        raise FileError(f"{folder}: is no folder with imu.csv, stars.csv and meta.json.")
    known = read_known(folder / "meta.json")
    # what is no number is refused packet by packet, with a reason
    path = folder / "imu.csv"
    table = load_table(path, IMU_COLUMNS, is_finite=False)
    imu, noise = table.numbers, noise_of(known)
    period_s = noise.packet_period_s
    _refuse(path, complaint_about_order(imu[:, 0]))
    _refuse(path, complaint_about_units(imu[:, 0], period_s))
    _refuse(path, complaint_about_bunches(imu, period_s))
    _refuse(path, complaint_about_temperatures(imu[:, 4]))
    if with_stars:  # a rest alone has its channels judged one by one
        _refuse(path, complaint_about_readings(imu, noise))
        _refuse(path, complaint_about_dead_channels(imu, noise))
    imu[:, 4], notes = without_wild_temperatures(imu[:, 4], table.lines.tolist(), path.name)
    notes += notes_of_still_channels(imu, path.name)
    stars = np.empty((0, len(STAR_COLUMNS)))
    if with_stars:
        stars = load_table(folder / "stars.csv", STAR_COLUMNS, is_finite=False).numbers
        _refuse(folder / "stars.csv", complaint_about_places(stars))
        _refuse(folder / "stars.csv", complaint_about_columns(stars))
    variance = [noise.star_sigma_xy_m**2, noise.star_sigma_xy_m**2, noise.star_sigma_heading_rad**2]
    covariance = np.tile(np.diag(variance), (len(stars), 1, 1))
    given = FlightData(imu, stars, covariance, known["run_start_s"], noise, notes=notes)
    data = given.screened(
        lambda found: (
            *notes_of(found, imu[:, 0], table.lines.tolist(), path.name),
            *note_of_rest(found.stamp_s, known["run_start_s"], path.name),
        )
    )
    stamp_s = data.imu[:, 0]
    _refuse(path, complaint_about_start(stamp_s, known["duration_s"]))
    _refuse(path, complaint_about_rate(stamp_s, period_s))
    _refuse(folder / "stars.csv", complaint_about_fixes(data.stars, stamp_s))
    _refuse(folder / "stars.csv", complaint_about_scatter(data.stars, known["run_start_s"], noise))
    return data


def _refuse(path: Path, complaint: str | None) -> None:
    if complaint is not None:
        raise FileError(f"{path}: {complaint}.")


def noise_of(known: dict[str, Any]) -> NoiseModel:
    """Turn the `known` block into the filter's error model."""
    poll = known["poll_rate_hz"]
    return NoiseModel(
        packet_period_s=1.0 / known["imu_rate_hz"],
        gyro_density_rad_s_rthz=packet_density(known["gyro_noise_poll_rad_s"], known["gyro_lsb_rad_s"], poll),
        acc_density_m_s2_rthz=packet_density(known["acc_noise_poll_m_s2"], known["acc_lsb_m_s2"], poll),
        gyro_bias_walk_rad_s_rts=math.hypot(
            GYRO_BIAS_WALK_RAD_S_RTS, rounding_walk(known["gyro_noise_poll_rad_s"], known["gyro_lsb_rad_s"])
        ),
        star_sigma_xy_m=known["star_sigma_xy_m"],
        star_sigma_heading_rad=known["star_sigma_heading_rad"],
        fix_time_sigma_s=FIX_TIME_POLLS / poll,
        fix_delay_sigma_s=FIX_DELAY_POLLS / poll,
        imu_offset_x_m=known["imu_offset_m"][0],
        imu_offset_y_m=known["imu_offset_m"][1],
        imu_offset_sigma_m=known["imu_offset_sigma_m"],
        gyro_tempco_rad_s_c=known["gyro_tempco_rad_s_C"],
        acc_tempco_m_s2_c=known["acc_tempco_m_s2_C"],
        gyro_lag_s=lag_of_bandwidth(known["gyro_bandwidth_hz"]),
        acc_lag_s=lag_of_bandwidth(known["acc_bandwidth_hz"]),
    )
