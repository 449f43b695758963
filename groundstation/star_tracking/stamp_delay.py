"""The camera's delay as its calibration wrote it, for those who stamp pictures and fuse fixes."""

import math
import tomllib
from dataclasses import dataclass
from pathlib import Path

from groundstation.files.errors import CalibrationFileError


@dataclass(frozen=True, slots=True)
class StampDelay:
    """From the middle of the exposure to the picture's arrival.

    Attributes:
        delay_s: What to take off an arrival.
        sigma_s: One sigma of a single picture's stamp: of the delay itself, and of its jitter.
    """

    delay_s: float
    sigma_s: float


def read_delay(path: Path) -> StampDelay:
    """Read ``[delay]`` and ``[jitter]`` of a delay calibration (TOML).

    Raises:
        CalibrationFileError: The file is missing, no TOML, or a value is missing or impossible.
    """
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "is no text"
        raise CalibrationFileError(f"{path}: cannot be read ({reason}).") from error
    except tomllib.TOMLDecodeError as error:
        raise CalibrationFileError(f"{path}: is not valid TOML: {error}.") from error
    delay_s, sigma_s = _number(path, content, "delay", "value"), _number(path, content, "delay", "std")
    jitter_s = _number(path, content, "jitter", "value") if "jitter" in content else 0.0
    return StampDelay(delay_s, math.hypot(sigma_s, jitter_s))


def _number(path: Path, content: dict[str, object], table: str, key: str) -> float:
    section = content.get(table)
    if not isinstance(section, dict) or key not in section:
        raise CalibrationFileError(
            f"{path}: '{key}' of [{table}] is missing; expected what `star-tracker delay` writes."
        )
    if section.get("unit") != "s":
        raise CalibrationFileError(f"{path}: the unit of [{table}] is {section.get('unit')!r}, expected 's'.")
    value = section[key]
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value < math.inf:
        raise CalibrationFileError(
            f"{path}: {key} of [{table}] is {value!r}, expected a number of zero or more."
        )
    return float(value)
