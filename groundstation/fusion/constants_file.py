"""The constants of a mock-up that calibration files hold: read back from the TOML that the commands wrote."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from groundstation.files.errors import FileError
from groundstation.files.reading import read_bytes
from groundstation.files.toml_file import parse_toml

ALIASES: Mapping[str, str] = {
    "scale": "gyro_scale",
    "omega_slope": "gyro_temperature_slope",
    "ax_slope": "acc_x_temperature_slope",
    "ay_slope": "acc_y_temperature_slope",
}
"""What single calibrations call what the joint one names in full."""
UNITS: Mapping[str, str] = {
    "gyro_scale": "1",
    "acc_scale_x": "1",
    "acc_cross_xy": "1",
    "acc_cross_yx": "1",
    "acc_scale_y": "1",
    "lever_x": "m",
    "lever_y": "m",
    "gyro_temperature_slope": "rad/s/C",
    "acc_x_temperature_slope": "m/s^2/C",
    "acc_y_temperature_slope": "m/s^2/C",
    "camera_delay": "s",
}
"""What lasts from one run to the next, with the unit that a file must give it in."""


Constants = dict[str, tuple[float, float]]
"""Value and sigma by name."""


def read_constants(paths: Sequence[Path]) -> Constants:
    """Read value and sigma of every constant that lasts; of one that several files hold, the surest counts.

    Raises:
        FileError: A file is missing, no TOML or without such a constant; or one of them is wrong.
    """
    return surest(parse_constants(read_bytes(path), path) for path in paths)


def surest(files: Iterable[Constants]) -> Constants:
    """Return the constants of several files; of one that several hold, the surest counts."""
    found: Constants = {}
    for constants in files:
        for name, (value, sigma) in constants.items():
            if name not in found or sigma < found[name][1]:
                found[name] = (value, sigma)
    return found


def parse_constants(data: bytes, path: Path) -> Constants:
    """Read the content of one file.

    Raises:
        FileError: It is no TOML or without a constant that lasts; or one of them is wrong.
    """
    text = parse_toml(data, path)
    found = {}
    for key, table in text.items():
        name = ALIASES.get(key, key)
        if name not in UNITS or not isinstance(table, dict):
            continue
        value, sigma = _number(path, key, table, "value"), _number(path, key, table, "std")
        if math.isnan(value) or math.isnan(sigma):
            continue  # the calibration could not determine it
        if not (math.isfinite(value) and math.isfinite(sigma) and sigma > 0.0):
            raise FileError(f"{path}: {key} must be finite with a std above zero.")
        if table.get("unit") != UNITS[name]:
            raise FileError(
                f"{path}: {key} must be in the unit {UNITS[name]!r}, found {table.get('unit')!r:.80}."
            )
        found[name] = (value, sigma)
    if not found:
        raise FileError(
            f"{path} holds no constant that lasts: give it the result of `calibrate joint`, `imu`, `tilt`, "
            "`gyro-scale` or `temperature`."
        )
    return found


def _number(path: Path, key: str, table: dict[str, object], part: str) -> float:
    value = table.get(part)
    try:
        if isinstance(value, int | float) and not isinstance(value, bool):
            return float(value)  # NaN is what a calibration writes that could not determine it
    except OverflowError:
        pass  # a whole number of hundreds of digits
    raise FileError(f"{path}: {key}.{part} must be a number, found {value!r:.80}.")
