"""Files of the side camera and of the hulls that it sees, as the emulator reads them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from firmware_emulator.scene_files import CameraFile, is_number, read_tables

_MOST_PX, _FARTHEST_M, _MOST_RAD = 1e5, 100.0, 7.0
_MOST_PIXELS = 50_000_000
"""Of a picture: more are no camera's, and fill the memory."""
_LEAST_M = 0.005
"""Of a hull's radius."""


@dataclass(frozen=True, slots=True)
class SideOptics:
    """A levelled pinhole camera on a hull: lens free of distortion, place, direction.

    Attributes:
        width_px: Columns of the picture.
        height_px: Rows of the picture.
        focal_px: Focal length.
        centre_px: (cx, cy).
        position_body_m: Optical centre in the body frame, z up from the table's surface.
        yaw_rad: From body +x to the optical axis, counter-clockwise; the axis is horizontal.

    Raises:
        ValueError: A size, focal length or height that is not positive.
    """

    width_px: int
    height_px: int
    focal_px: float
    centre_px: tuple[float, float]
    position_body_m: tuple[float, float, float]
    yaw_rad: float

    def __post_init__(self) -> None:
        if not min(self.width_px, self.height_px, self.focal_px, self.position_body_m[2]) > 0.0:
            raise ValueError("width, height, focal length and height above the table must be positive")
        if max(self.width_px, self.height_px, self.focal_px, *map(abs, self.centre_px)) > _MOST_PX:
            raise ValueError(f"sizes must be below {_MOST_PX:g} px")
        if self.width_px * self.height_px > _MOST_PIXELS:
            raise ValueError(f"width times height must be below {_MOST_PIXELS} pixels")
        if max(map(abs, self.position_body_m)) > _FARTHEST_M or abs(self.yaw_rad) > _MOST_RAD:
            raise ValueError("position_body_m is in metres, yaw_rad in radians")


@dataclass(frozen=True, slots=True)
class Marker:
    """A round lamp glued on a hull: where around it, from body +x, and how high above the table."""

    azimuth_rad: float
    height_m: float


@dataclass(frozen=True, slots=True)
class Hull:
    """An upright cylinder about the body's origin.

    Attributes:
        radius_m: Of the cylinder.
        bottom_m: Height of its lower edge above the table.
        top_m: Of its upper edge.
        markers: On its side; a hull with markers is black, one without is white.
        marker_radius_m: Of each, along the surface.

    Raises:
        ValueError: A size that is not positive.
    """

    radius_m: float
    bottom_m: float
    top_m: float
    markers: tuple[Marker, ...] = ()
    marker_radius_m: float = 0.0

    def __post_init__(self) -> None:
        if not (_LEAST_M <= self.radius_m < _FARTHEST_M and 0.0 <= self.bottom_m < self.top_m < _FARTHEST_M):
            raise ValueError(f"a hull needs a radius_m of {_LEAST_M:g} or more, and bottom_m below top_m")
        if self.markers and not 0.0 < self.marker_radius_m < self.radius_m:
            raise ValueError("markers need a marker_radius_m above 0, below that of the hull")
        if any(abs(marker.height_m) > _FARTHEST_M for marker in self.markers):
            raise ValueError("height_m of a marker is in metres")


def read_side_camera(path: Path) -> SideOptics:
    """Optics of a side camera's file (JSON).

    Raises:
        FileError: The file is missing, or a key is missing or holds something else than its number.
    """
    return CameraFile(path).makes(_optics)


def _optics(file: CameraFile) -> SideOptics:
    x_m, y_m, z_m = file.numbers("position_body_m", 3)
    return SideOptics(
        width_px=int(file.number("width")),
        height_px=int(file.number("height")),
        focal_px=file.number("f_px"),
        centre_px=(file.number("cx"), file.number("cy")),
        position_body_m=(x_m, y_m, z_m),
        yaw_rad=file.number("yaw_rad"),
    )


def read_hulls(path: Path) -> dict[str, Hull]:
    """The hull of every mock-up (TOML).

    Raises:
        FileError: The file is missing or is not of that form.
    """
    return read_tables(path, _hull, "radius_m, bottom_m, top_m and markers")


def _hull(table: Mapping[str, Any]) -> Hull:
    rows = table.get("markers", [])
    markers = tuple(Marker(math.radians(_finite(row["azimuth_deg"])), _finite(row["z_m"])) for row in rows)
    radius_m, bottom_m, top_m = (_finite(table[key]) for key in ("radius_m", "bottom_m", "top_m"))
    return Hull(radius_m, bottom_m, top_m, markers, _finite(table.get("marker_radius_m", 0.0)))


def _finite(value: object) -> float:
    if not is_number(value):
        raise ValueError(f"{value!r:.80} is no finite number")
    if abs(float(value)) > 1e6:
        raise ValueError(f"{value!r:.80} is too large")
    return float(value)
