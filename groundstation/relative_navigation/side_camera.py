"""A levelled camera on a hull that looks along the table: lens, place, direction, read from a JSON file."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.files.json_file import made_of_json
from groundstation.files.reading import read_bytes
from groundstation.files.values import check_amount, number, numbers, whole_number
from groundstation.relative_navigation.pinhole import PinholeCamera

Floats = NDArray[np.float64]

_KEYS = ("width", "height", "f_px", "cx", "cy", "position_body_m", "yaw_rad")
_FARTHEST_M, _MOST_ANGLE_RAD = 100.0, 7.0


@dataclass(frozen=True, slots=True)
class SideCamera:
    """A camera whose optical axis is horizontal and whose pictures are free of distortion.

    Attributes:
        lens: Its lens.
        position_body_m: Optical centre in the body frame of its mock-up; z is the height above the table.
        yaw_rad: From body +x to the optical axis, counter-clockwise seen from above.

    Raises:
        ValueError: A number that is not finite, or a camera that is not above the table.
    """

    lens: PinholeCamera
    position_body_m: tuple[float, float, float]
    yaw_rad: float

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, (*self.position_body_m, self.yaw_rad))):
            raise ValueError("every number of a side camera must be finite")
        for value in self.position_body_m:
            check_amount("key 'position_body_m'", value, _FARTHEST_M, "is it in mm?")
        check_amount("key 'yaw_rad'", self.yaw_rad, _MOST_ANGLE_RAD, "is it in degrees?")
        if not self.position_body_m[2] > 0.0:
            raise ValueError("key 'position_body_m' must put the camera above the table (z > 0)")

    @property
    def axes_body(self) -> tuple[Floats, Floats]:
        """The picture's right and the optical axis in the body frame, (2,) each."""
        cosine, sine = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        return np.array((sine, -cosine)), np.array((cosine, sine))

    @classmethod
    def load(cls, path: Path | str) -> "SideCamera":
        """Read the camera's JSON file.

        Raises:
            FileError: The file is missing, no JSON, or a key is missing or impossible.
        """
        return cls.parse(read_bytes(Path(path)), Path(path))

    @classmethod
    def parse(cls, data: bytes, path: Path) -> "SideCamera":
        """Read the content of the camera's JSON file.

        Raises:
            FileError: It is no JSON, or a key is missing or impossible.
        """
        return made_of_json(data, path, cls.from_mapping)

    @classmethod
    def from_mapping(cls, data: Mapping[str, Any]) -> "SideCamera":
        """Make one from the keys of the JSON file.

        Raises:
            ValueError: A key is missing, unknown or impossible; the message names it.
        """
        unknown = set(data) - set(_KEYS)
        if unknown:
            raise ValueError(f"'{min(unknown)}' is no key of a side camera")
        width, height = (whole_number(data, key) for key in ("width", "height"))
        lens = PinholeCamera(number(data, "f_px"), number(data, "cx"), number(data, "cy"), width, height)
        x, y, z = numbers(data, "position_body_m", 3)
        return cls(lens, (x, y, z), number(data, "yaw_rad"))
