"""The files of a fusion data set: what is read, what is refused in one sentence, what is written."""

from __future__ import annotations

import json
import math
import os
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.cli.errors import UsageError
from groundstation.fusion.noise import NoiseModel, lag_of_bandwidth, packet_density

Array = NDArray[np.float64]

IMU_COLUMNS = ("t_s", "omega_rad_s", "ax_m_s2", "ay_m_s2", "temperature_C")
STAR_COLUMNS = ("t_exposure_s", "t_arrival_s", "x_m", "y_m", "heading_rad")
POSITIVE_KEYS = (
    "duration_s", "imu_rate_hz", "poll_rate_hz", "star_sigma_xy_m", "star_sigma_heading_rad",
)  # fmt: skip
FIX_TIME_POLLS = 1.0
"""How well an exposure's stamp can be laid on the packets: nothing happens between two polls of the sensors.
Data sets do not say it; live, the clock's own sigma goes into each fix's covariance instead."""
FIX_DELAY_POLLS = 0.5
"""The constant part of it: what the best calibration of a camera's delay leaves."""
OTHER_KEYS = (
    "run_start_s", "imu_offset_sigma_m", "gyro_noise_poll_rad_s", "acc_noise_poll_m_s2", "gyro_lsb_rad_s",
    "acc_lsb_m_s2", "gyro_tempco_rad_s_C", "acc_tempco_m_s2_C", "gyro_bandwidth_hz", "acc_bandwidth_hz",
)  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class FusionFolder:
    """One data set as read."""

    imu: Array
    """(n, 5) stamp s, omega, ax, ay, temperature, in the order of the file."""
    stars: Array
    """(m, 5) exposure s, arrival s, x, y, heading, in order of arrival."""
    run_start_s: float
    noise: NoiseModel


def read_folder(folder: Path) -> FusionFolder:
    """Read imu.csv, stars.csv and the `known` block of meta.json.

    Raises:
        UsageError: a file, column, key or value is missing or wrong.
    """
    if not folder.is_dir():
        raise UsageError(f"{folder} is not a folder with imu.csv, stars.csv and meta.json.")
    known = read_known(folder / "meta.json")
    imu = read_table(folder / "imu.csv", IMU_COLUMNS)
    stars = read_table(folder / "stars.csv", STAR_COLUMNS)
    # a stamp that is no number sorts to the end, where it is refused with a reason
    stars = stars[np.argsort(stars[:, 1], kind="stable")]
    return FusionFolder(imu, stars, known["run_start_s"], noise_of(known))


def noise_of(known: dict[str, Any]) -> NoiseModel:
    """Turn the `known` block into the filter's error model."""
    poll = known["poll_rate_hz"]
    return NoiseModel(
        packet_period_s=1.0 / known["imu_rate_hz"],
        gyro_density_rad_s_rthz=packet_density(known["gyro_noise_poll_rad_s"], known["gyro_lsb_rad_s"], poll),
        acc_density_m_s2_rthz=packet_density(known["acc_noise_poll_m_s2"], known["acc_lsb_m_s2"], poll),
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


def read_known(path: Path) -> dict[str, Any]:
    """Read and check the `known` block of a meta.json.

    Raises:
        UsageError: a key is missing or wrong.
    """
    try:
        meta = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise UsageError(f"{path} is missing.") from None
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"{path} cannot be read: {error}.") from None
    except json.JSONDecodeError as error:
        raise UsageError(f"{path}, line {error.lineno}: this is not JSON ({error.msg}).") from None
    known = meta.get("known") if isinstance(meta, dict) else None
    if not isinstance(known, dict):
        raise UsageError(f'{path} has no block "known".')
    for key in (*POSITIVE_KEYS, *OTHER_KEYS):
        _check_number(path, f"known.{key}", known.get(key), positive=key in POSITIVE_KEYS)
    offset = known.get("imu_offset_m")
    if not (isinstance(offset, list) and len(offset) == 2):
        raise UsageError(f"{path}: known.imu_offset_m must be two numbers in m, found {offset!r}.")
    for value in offset:
        _check_number(path, "known.imu_offset_m", value, positive=False)
    for noise, lsb in (("gyro_noise_poll_rad_s", "gyro_lsb_rad_s"), ("acc_noise_poll_m_s2", "acc_lsb_m_s2")):
        if min(known[noise], known[lsb]) < 0.0 or known[noise] + known[lsb] == 0.0:
            raise UsageError(f"{path}: known.{noise} and known.{lsb} must not be negative nor both zero.")
    return known


def _check_number(path: Path, key: str, value: object, *, positive: bool) -> None:
    if value is None:
        raise UsageError(f"{path} has no key {key}.")
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise UsageError(f"{path}: {key} must be a finite number, found {value!r}.")
    if positive and value <= 0.0:
        raise UsageError(f"{path}: {key} must be above zero, found {value!r}.")


def read_table(path: Path, columns: Sequence[str]) -> Array:
    """Read named columns of a CSV file with one header line, whatever their order.

    Raises:
        UsageError: no file, a missing column, a value that is no number, no rows.
    """
    try:
        with path.open(encoding="utf-8") as file:
            header = [name.strip() for name in file.readline().strip().split(",")]
    except FileNotFoundError:
        raise UsageError(f"{path} is missing.") from None
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"{path} cannot be read: {error}.") from None
    for name in columns:
        if name not in header:
            raise UsageError(f"{path}, line 1: column {name} is missing; found {', '.join(header)}.")
    wanted = [header.index(name) for name in columns]
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # an empty file is answered below
            table = np.loadtxt(path, delimiter=",", skiprows=1, usecols=wanted, ndmin=2, encoding="utf-8")
    except ValueError:
        raise UsageError(_first_bad_line(path, wanted, columns)) from None
    if len(table) == 0:
        raise UsageError(f"{path} has a header but no rows.")
    return np.asarray(table, dtype=np.float64)


def _first_bad_line(path: Path, wanted: Sequence[int], columns: Sequence[str]) -> str:
    """Say where the first unreadable value stands; slow, so only after numpy has given up."""
    with path.open(encoding="utf-8", errors="replace") as file:
        for number, line in enumerate(file, start=1):
            cells = line.rstrip("\n").split(",")
            if number == 1 or not line.strip():
                continue
            for index, name in zip(wanted, columns, strict=True):
                if index >= len(cells):
                    return (
                        f"{path}, line {number}: {len(cells)} values found, column {name} is not among them."
                    )
                try:
                    float(cells[index])
                except ValueError:
                    return f"{path}, line {number}: {name} must be a number, found {cells[index].strip()!r}."
    return f"{path} is not a table of numbers."


def write_atomically(files: dict[Path, Iterable[str]]) -> None:
    """Write all files or none: temporary files beside them first, then renamed.

    Raises:
        UsageError: a folder does not exist or may not be written.
    """
    made: list[tuple[Path, Path]] = []
    try:
        for path, lines in files.items():
            temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
            made.append((temporary, path))
            with temporary.open("w", encoding="utf-8") as file:
                file.writelines(lines)
        for temporary, path in made:
            os.replace(temporary, path)  # noqa: PTH105 - the call that promises atomicity
    except OSError as error:
        raise UsageError(f"{path} cannot be written: {error.strerror}.") from None
    finally:
        for temporary, _ in made:
            temporary.unlink(missing_ok=True)
