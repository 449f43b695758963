"""What each mock-up looks like from the side, from a TOML file: an upright cylinder, with markers or plain.

One table per mock-up: ``radius_m``, ``bottom_m`` and ``top_m`` of the cylinder about the body's origin,
heights above the table; where it wears markers, ``marker_radius_m`` and ``markers``, each with
``azimuth_deg`` from body +x, counter-clockwise, and ``z_m``.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from groundstation.files.reading import read_bytes
from groundstation.files.toml_file import made_of_tables
from groundstation.files.values import check_amount, check_keys, number

Floats = NDArray[np.float64]

FEWEST_MARKERS = 3
MOST_MARKERS = 64
LEAST_APART_M = 0.02
"""Between two markers: nearer ones melt into one spot."""
ALIKE_M = 0.003
"""Markers that a turn brings so near to others are the same pattern again."""
INWARD_RATIO = 0.125
"""By this times the square of its radius over the hull's, a round sticker's light is nearer to the axis than
the surface: the mean of 1 - cos s over a disk."""
_LEAST_M, _MOST_M = 0.005, 10.0
"""Of a body's radius and height."""


@dataclass(frozen=True, slots=True)
class SideBody:
    """One mock-up seen from the side.

    Attributes:
        vehicle: Its name.
        radius_m: Of the cylinder.
        bottom_m: Height of its lower edge above the table.
        top_m: Of its upper edge.
        azimuths_rad: Of the markers, from body +x.
        heights_m: Of the markers above the table.
        marker_radius_m: Of each, along the surface.

    Raises:
        ValueError: The body cannot be seen, or its markers give no pose; the message gives the reason.
    """

    vehicle: str
    radius_m: float
    bottom_m: float
    top_m: float
    azimuths_rad: tuple[float, ...] = ()
    heights_m: tuple[float, ...] = ()
    marker_radius_m: float = 0.0

    def __post_init__(self) -> None:
        for key in ("radius_m", "bottom_m", "top_m", "marker_radius_m"):
            check_amount(f"{self.vehicle}.{key}", getattr(self, key), _MOST_M, "is it in mm?")
        if not self.radius_m >= _LEAST_M:
            raise ValueError(f"{self.vehicle}.radius_m is {self.radius_m:g}, expected at least {_LEAST_M:g}")
        if not 0.0 <= self.bottom_m < self.top_m:
            raise ValueError(f"{self.vehicle}: bottom_m must be at least 0 and below top_m")
        if not self.top_m - self.bottom_m >= _LEAST_M:
            raise ValueError(f"{self.vehicle}: top_m must be at least {_LEAST_M:g} above bottom_m")
        if self.azimuths_rad:
            self._check_markers()

    def _check_markers(self) -> None:
        if not 0.0 < self.marker_radius_m < self.radius_m:
            raise ValueError(f"{self.vehicle}.marker_radius_m must lie between 0 and radius_m")
        count = len(self.azimuths_rad)
        if not FEWEST_MARKERS <= count <= MOST_MARKERS:
            raise ValueError(
                f"{self.vehicle}.markers: {count} of them, expected {FEWEST_MARKERS} to {MOST_MARKERS}"
            )
        if not all(self.bottom_m < height < self.top_m for height in self.heights_m):
            raise ValueError(f"{self.vehicle}.markers: each z_m lies between bottom_m and top_m")
        points = self.points_body_m()
        apart_m = np.linalg.norm(points[:, None] - points[None], axis=2)[np.triu_indices(count, 1)]
        if apart_m.min() < LEAST_APART_M:
            raise ValueError(
                f"{self.vehicle}.markers: two of them are less than {1e3 * LEAST_APART_M:g} mm apart"
            )
        spread = np.linalg.svd(points[:, :2] - points[:, :2].mean(axis=0), compute_uv=False)
        if spread[0] < LEAST_APART_M:
            raise ValueError(f"{self.vehicle}.markers: all above each other, so no turn is seen")
        if spread[1] < 1e-3 * self.radius_m:
            raise ValueError(
                f"{self.vehicle}.markers: all in one upright plane, which looks alike turned to either side: "
                "spread them around the hull"
            )
        turn_rad = self._repeats_after()
        if turn_rad:
            raise ValueError(
                f"{self.vehicle}.markers: turned by {math.degrees(turn_rad):.0f} deg they are the same "
                "pattern again, so no turn is seen: move some of them, or change their heights"
            )

    def _repeats_after(self) -> float:
        """A turn that maps all markers on each other, rad; 0 if none does."""
        azimuth, height = np.array(self.azimuths_rad), np.array(self.heights_m)
        reach_m = self.radius_m
        for turn in (azimuth - azimuth[0])[1:].tolist():
            off = azimuth[:, None] + turn - azimuth[None]
            off_m = reach_m * np.abs((off + math.pi) % math.tau - math.pi)
            gaps_m = np.hypot(off_m, height[:, None] - height[None])
            if abs(math.remainder(turn, math.tau)) * reach_m > ALIKE_M and gaps_m.min(axis=1).max() < ALIKE_M:
                return math.remainder(turn, math.tau) % math.tau
        return 0.0

    def points_body_m(self) -> Floats:
        """Where the light of each marker is centred in the body frame, (n, 3), z above the table."""
        inward = 1.0 - INWARD_RATIO * (self.marker_radius_m / self.radius_m) ** 2
        azimuth = np.array(self.azimuths_rad)
        reach_m = self.radius_m * inward
        return np.column_stack((reach_m * np.cos(azimuth), reach_m * np.sin(azimuth), self.heights_m))

    def check_seen_from(self, camera_height_m: float) -> None:
        """Refuse a body whose top or bottom face a camera would see, or whose markers are all at its height.

        Raises:
            ValueError: So it is.
        """
        if not self.bottom_m < camera_height_m < self.top_m:
            raise ValueError(
                f"{self.vehicle}: the camera is {camera_height_m:g} m high, expected between bottom_m = "
                f"{self.bottom_m:g} and top_m = {self.top_m:g}"
            )


def load_side_bodies(path: Path | str) -> tuple[SideBody, ...]:
    """Read the bodies of all mock-ups.

    Raises:
        FileError: The file is missing, no TOML, or a key is missing or impossible.
    """
    return parse_side_bodies(read_bytes(Path(path)), Path(path))


def parse_side_bodies(data: bytes, path: Path) -> tuple[SideBody, ...]:
    """Read the content of the file of bodies.

    Raises:
        FileError: It is no TOML, or a key is missing or impossible.
    """
    return made_of_tables(
        data, path, lambda tables: tuple(_body(name, table) for name, table in tables.items())
    )


def _body(name: str, table: object) -> SideBody:
    if not isinstance(table, dict):
        raise ValueError(f"'{name}' must be a table with radius_m, bottom_m and top_m")
    check_keys(table, name, ("radius_m", "bottom_m", "top_m", "marker_radius_m", "markers"))
    rows = table.get("markers", [])
    if not isinstance(rows, list):
        raise ValueError(f"{name}.markers must be a list")
    azimuths, heights = [], []
    for index, row in enumerate(rows):
        where = f"{name}.markers.{index}"
        if not isinstance(row, dict):
            raise ValueError(f"{where} must be a table with azimuth_deg and z_m")
        check_keys(row, where, ("azimuth_deg", "z_m"))
        azimuth_deg = number(row, "azimuth_deg", f"{where}.azimuth_deg")
        check_amount(f"{where}.azimuth_deg", azimuth_deg, 3600.0)
        azimuths.append(math.radians(azimuth_deg))
        heights.append(number(row, "z_m", f"{where}.z_m"))
    radius_m, bottom_m, top_m = (
        number(table, key, f"{name}.{key}") for key in ("radius_m", "bottom_m", "top_m")
    )
    wide_m = 0.0
    if rows or "marker_radius_m" in table:
        wide_m = number(table, "marker_radius_m", f"{name}.marker_radius_m")
    return SideBody(name, radius_m, bottom_m, top_m, tuple(azimuths), tuple(heights), wide_m)
