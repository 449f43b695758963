"""A flight written as the folder of a fusion data set: imu.csv, stars.csv, meta.json, truth.csv."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.data_sets.fusion_folder import IMU_COLUMNS, STAR_COLUMNS
from groundstation.fusion.flight_data import FlightData

Array = NDArray[np.float64]
FORMAT = "airtable-fusion-1"
POLL_RATE_HZ = 1000.0
TRUTH_COLUMNS = ("t_s", "x_m", "y_m", "heading_rad", "vx_m_s", "vy_m_s", "omega_rad_s")


def folder_files(data: FlightData, more: Mapping[str, Any], scenario: str) -> dict[str, str]:
    """Return the text of each file by its name.

    Args:
        data: The flight.
        more: Keys of the `known` block that a flight does not hold: mass and bandwidths.
        scenario: What was flown.
    """
    files = {
        "imu.csv": _csv(IMU_COLUMNS, data.imu, "%.6f,%.8f,%.7f,%.7f,%.6f"),
        "stars.csv": _csv(STAR_COLUMNS, data.stars, "%.6f,%.6f,%.6f,%.6f,%.7f"),
        "meta.json": json.dumps(
            {
                "format": FORMAT,
                "scenario": scenario,
                "known": {**known_of(data), **more},
                "truth": {"config": {"mode": "recorded", "outage": []}, "wrong_fixes": []},
            },
            indent=1,
        )
        + "\n",
    }
    if len(data.reference):
        files["truth.csv"] = _csv(TRUTH_COLUMNS, data.reference, "%.6f,%.7f,%.7f,%.7f,%.7f,%.7f,%.7f")
    return files


def known_of(data: FlightData) -> dict[str, Any]:
    """Return what a flight knows of itself, as the `known` block names it.

    The noise is given as that of one poll at 1 kHz without rounding: means of polls have the same density.
    """
    noise = data.noise
    delay_s = float(np.median(data.stars[:, 1] - data.stars[:, 0])) if len(data.stars) else 0.0
    return {
        "run_start_s": round(data.run_start_s, 6),
        "duration_s": float(data.imu[-1, 0]),
        "imu_rate_hz": 1.0 / noise.packet_period_s,
        "poll_rate_hz": POLL_RATE_HZ,
        "imu_offset_m": [noise.imu_offset_x_m, noise.imu_offset_y_m],
        "imu_offset_sigma_m": noise.imu_offset_sigma_m,
        "star_sigma_xy_m": noise.star_sigma_xy_m,
        "star_sigma_heading_rad": noise.star_sigma_heading_rad,
        "star_delay_s": delay_s,
        "gyro_noise_poll_rad_s": noise.gyro_density_rad_s_rthz * math.sqrt(POLL_RATE_HZ),
        "acc_noise_poll_m_s2": noise.acc_density_m_s2_rthz * math.sqrt(POLL_RATE_HZ),
        "gyro_lsb_rad_s": 0.0,
        "acc_lsb_m_s2": 0.0,
        "gyro_tempco_rad_s_C": noise.gyro_tempco_rad_s_c,
        "acc_tempco_m_s2_C": noise.acc_tempco_m_s2_c,
    }


def _csv(columns: tuple[str, ...], rows: Array, form: str) -> str:
    return "".join([",".join(columns) + "\n", *(form % tuple(row) + "\n" for row in rows.tolist())])
