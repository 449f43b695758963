"""Files of the camera over the table and of the circles on the mock-ups, as the emulator reads them."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drivers.files.reading import read_bytes
from drivers.files.trees import parse_json, parse_toml
from firmware_emulator.overhead.optics import OverheadOptics
from firmware_emulator.sky.scene import SceneError, is_number

_NUMBERS = {"dist_k1_k2_p1_p2_k3": 5, "position_table_m": 3}


@dataclass(frozen=True, slots=True)
class Disc:
    """A coloured disc on top of a mock-up: colour's name and centre in the body frame."""

    colour: str
    x_m: float
    y_m: float


@dataclass(frozen=True, slots=True)
class Markings:
    """The discs of one mock-up, all of one radius at one height above the table."""

    height_m: float
    radius_m: float
    discs: tuple[Disc, ...]


def read_overhead_camera(path: Path) -> OverheadOptics:
    """Optics of a camera file (JSON).

    Raises:
        FileError: The file is missing, or a key is missing or holds something else than its number.
    """
    data = parse_json(read_bytes(path), path)

    def numbers(key: str) -> tuple[float, ...]:
        value = data.get(key)
        values = value if isinstance(value, list) else [value]
        found = [float(item) for item in values if is_number(item)]
        if not len(found) == len(values) == _NUMBERS.get(key, 1):
            raise SceneError(
                f"{path}: key {key!r} must hold {_NUMBERS.get(key, 1)} numbers, found {value!r:.80}"
            )
        return tuple(found)

    k1, k2, p1, p2, k3 = numbers("dist_k1_k2_p1_p2_k3")
    x, y, z = numbers("position_table_m")
    try:
        return OverheadOptics(
            width_px=int(numbers("width")[0]),
            height_px=int(numbers("height")[0]),
            focal_px=(numbers("fx")[0], numbers("fy")[0]),
            centre_px=(numbers("cx")[0], numbers("cy")[0]),
            distortion=(k1, k2, p1, p2, k3),
            position_m=(x, y, z),
            yaw_rad=numbers("yaw_rad")[0],
            tilt_x_rad=numbers("tilt_x_rad")[0],
            tilt_y_rad=numbers("tilt_y_rad")[0],
        )
    except SceneError:
        raise
    except ValueError as error:
        raise SceneError(f"{path}: {error}") from error


def read_markings(path: Path) -> dict[str, Markings]:
    """The discs of every mock-up (TOML).

    Raises:
        FileError: The file is missing or is not of that form.
    """
    data = parse_toml(read_bytes(path), path)
    try:
        return {name: _markings(table) for name, table in data.items()}
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise SceneError(
            f"{path}: expected tables with height_m, radius_m and circles: {error!r:.200}"
        ) from error


def _markings(table: dict[str, Any]) -> Markings:
    discs = tuple(Disc(str(row["colour"]), float(row["x_m"]), float(row["y_m"])) for row in table["circles"])
    return Markings(float(table["height_m"]), float(table["radius_m"]), discs)
