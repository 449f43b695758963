"""Files of the camera over the table and of the circles on the mock-ups, as the emulator reads them."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from firmware_emulator.overhead.optics import OverheadOptics
from firmware_emulator.scene_files import CameraFile, read_tables


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
    return CameraFile(path).makes(_optics)


def _optics(file: CameraFile) -> OverheadOptics:
    k1, k2, p1, p2, k3 = file.numbers("dist_k1_k2_p1_p2_k3", 5)
    x_m, y_m, z_m = file.numbers("position_table_m", 3)
    return OverheadOptics(
        width_px=int(file.number("width")),
        height_px=int(file.number("height")),
        focal_px=(file.number("fx"), file.number("fy")),
        centre_px=(file.number("cx"), file.number("cy")),
        distortion=(k1, k2, p1, p2, k3),
        position_m=(x_m, y_m, z_m),
        yaw_rad=file.number("yaw_rad"),
        tilt_x_rad=file.number("tilt_x_rad"),
        tilt_y_rad=file.number("tilt_y_rad"),
    )


def read_markings(path: Path) -> dict[str, Markings]:
    """The discs of every mock-up (TOML).

    Raises:
        FileError: The file is missing or is not of that form.
    """
    return read_tables(path, _markings, "height_m, radius_m and circles")


def _markings(table: Mapping[str, Any]) -> Markings:
    discs = tuple(Disc(str(row["colour"]), float(row["x_m"]), float(row["y_m"])) for row in table["circles"])
    return Markings(float(table["height_m"]), float(table["radius_m"]), discs)
