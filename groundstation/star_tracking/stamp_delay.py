"""The camera's delay as its calibration wrote it, for those who stamp pictures and fuse fixes."""

import math
from dataclasses import dataclass
from pathlib import Path

from groundstation.files.errors import FileError
from groundstation.files.reading import read_bytes
from groundstation.files.toml_file import parse_toml
from groundstation.files.values import number


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
        FileError: The file is missing, no TOML, or a value is missing or impossible.
    """
    return parse_delay(read_bytes(path), path)


def parse_delay(data: bytes, path: Path) -> StampDelay:
    """Read the content of such a file.

    Raises:
        FileError: It is no TOML, or a value is missing or impossible.
    """
    content = parse_toml(data, path)
    delay_s, sigma_s = _number(path, content, "delay", "value"), _number(path, content, "delay", "std")
    jitter_s = _number(path, content, "jitter", "value") if "jitter" in content else 0.0
    return StampDelay(delay_s, math.hypot(sigma_s, jitter_s))


def _number(path: Path, content: dict[str, object], table: str, key: str) -> float:
    section = content.get(table)
    if not isinstance(section, dict) or key not in section:
        raise FileError(f"{path}: '{key}' of [{table}] is missing; expected what `calibrate delay` writes.")
    if section.get("unit") != "s":
        raise FileError(f"{path}: the unit of [{table}] is {section.get('unit')!r}, expected 's'.")
    value = section[key]
    try:
        found = number(section, key)
    except ValueError:
        found = -1.0
    if found < 0.0:
        raise FileError(f"{path}: {key} of [{table}] is {value!r:.80}, expected a number of zero or more.")
    return found
