"""The `known` block of a fusion data set's meta.json: every number within what such a rig can have."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from groundstation.files.errors import FileError
from groundstation.files.json_file import parse_json
from groundstation.files.reading import read_bytes
from groundstation.files.values import number, numbers

LEAST = 1e-6
"""Of what must be above zero."""
RANGES: Mapping[str, tuple[float, float]] = {
    "run_start_s": (0.0, 1e6),
    "duration_s": (LEAST, 1e6),
    "imu_rate_hz": (0.1, 1e4),
    "poll_rate_hz": (0.1, 1e5),
    "imu_offset_sigma_m": (0.0, 1.0),
    "star_sigma_xy_m": (LEAST, 1.0),
    "star_sigma_heading_rad": (LEAST, 3.2),
    "gyro_noise_poll_rad_s": (0.0, 1.0),
    "acc_noise_poll_m_s2": (0.0, 10.0),
    "gyro_lsb_rad_s": (0.0, 1.0),
    "acc_lsb_m_s2": (0.0, 10.0),
    "gyro_tempco_rad_s_C": (-0.1, 0.1),
    "acc_tempco_m_s2_C": (-1.0, 1.0),
    "gyro_bandwidth_hz": (0.0, 1e5),
    "acc_bandwidth_hz": (0.0, 1e5),
}
"""By key, from to, generously; what is outside is a typo or in another unit."""
OPTIONAL: Mapping[str, tuple[float, float]] = {
    "mass_kg": (0.01, 1e3),
    "inertia_kg_m2": (1e-5, 1e3),
    "star_delay_s": (0.0, 10.0),
}
"""Of keys that nothing is computed from; a wrong one still says that the block is not to be trusted."""
ARM_M = 1.0
"""No IMU lies farther from the centre of its mock-up."""


def read_known(path: Path) -> dict[str, Any]:
    """Read and check the `known` block of a meta.json.

    Raises:
        FileError: A key is missing, no number, or outside what it can be.
    """
    meta = parse_json(read_bytes(path), path)
    known = meta.get("known")
    if not isinstance(known, dict):
        raise FileError(f'{path}: has no block "known".')
    given = {key: ends for key, ends in OPTIONAL.items() if key in known}
    try:
        for key, ends in {**RANGES, **given}.items():
            _check(f"known.{key}", number(known, key, f"known.{key}"), *ends)
        for value in numbers(known, "imu_offset_m", 2, "known.imu_offset_m"):
            _check("known.imu_offset_m", value, -ARM_M, ARM_M)
    except ValueError as error:
        raise FileError(f"{path}: {error}.") from error
    for noise, lsb in (("gyro_noise_poll_rad_s", "gyro_lsb_rad_s"), ("acc_noise_poll_m_s2", "acc_lsb_m_s2")):
        if known[noise] + known[lsb] < 1e-12:
            raise FileError(f"{path}: known.{noise} and known.{lsb} must not both be zero.")
    return known


def _check(name: str, value: float, lowest: float, highest: float) -> None:
    if not lowest <= value <= highest:
        unit = "is it in another unit?" if value else "it must be above zero"
        raise ValueError(f"{name} is {value:g}, expected {lowest:g} to {highest:g} ({unit})")
