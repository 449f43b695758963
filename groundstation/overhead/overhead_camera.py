"""The camera over the table that looks down: lens, place and attitude, read from its JSON file."""

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
from groundstation.frames import turned_axes

_DOWN = np.diag([1.0, -1.0, -1.0])
_SIDES = ("width", "height")
_SINGLE = ("fx", "fy", "cx", "cy", "yaw_rad", "tilt_x_rad", "tilt_y_rad")
_MOST_PX, _MOST_DISTORTION, _FARTHEST_M, _MOST_ANGLE_RAD = 1e5, 100.0, 100.0, 7.0
_LISTS = ("dist_k1_k2_p1_p2_k3", "position_table_m")


@dataclass(frozen=True, slots=True)
class OverheadCamera:
    """A calibrated camera that looks down on the table.

    Attributes:
        width: Columns of the picture.
        height: Rows of the picture.
        fx: Focal length, px.
        fy: Focal length, px.
        cx: Principal point, px.
        cy: Principal point, px.
        distortion: k1, k2, p1, p2, k3 of OpenCV's model.
        position_table_m: Optical centre (x, y, z); z is the height above the table's surface.
        yaw_rad: From table +x to the picture's right, counter-clockwise seen from above.
        tilt_x_rad: Small turn about the level camera's table-ward x axis; see ``table_from_camera``.
        tilt_y_rad: Likewise about y.

    Raises:
        ValueError: A number that is not finite, or a size, focal length or height that is not positive.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, float, float, float, float]
    position_table_m: tuple[float, float, float]
    yaw_rad: float = 0.0
    tilt_x_rad: float = 0.0
    tilt_y_rad: float = 0.0

    def __post_init__(self) -> None:
        numbers = (self.cx, self.cy, *self.distortion, *self.position_table_m)
        angles = (self.yaw_rad, self.tilt_x_rad, self.tilt_y_rad)
        if not all(map(math.isfinite, (*numbers, *angles, self.fx, self.fy))):
            raise ValueError("every number of an overhead camera must be finite")
        for key in ("width", "height", "fx", "fy"):
            if not getattr(self, key) > 0:
                raise ValueError(f"key '{key}' must be positive, not {getattr(self, key)}")
        for key in ("width", "height", "fx", "fy", "cx", "cy"):
            check_amount(f"key '{key}'", getattr(self, key), _MOST_PX)
        for value in self.distortion:
            check_amount("key 'dist_k1_k2_p1_p2_k3'", value, _MOST_DISTORTION)
        for value in self.position_table_m:
            check_amount("key 'position_table_m'", value, _FARTHEST_M, "is it in mm?")
        for key in ("yaw_rad", "tilt_x_rad", "tilt_y_rad"):
            check_amount(f"key '{key}'", getattr(self, key), _MOST_ANGLE_RAD, "is it in degrees?")
        if not self.position_table_m[2] > 0.0:
            raise ValueError("key 'position_table_m' must put the camera above the table (z > 0)")
        if not self.table_from_camera()[2, 2] < 0.0:
            raise ValueError("the tilts turn the camera away from the table")

    def table_from_camera(self) -> NDArray[np.float64]:
        """Rotation (3, 3) whose columns are the camera axes in the table: Rz(yaw) Rx(tilt_x) Ry(tilt_y) D.

        D = diag(1, -1, -1) is the level camera: picture's right along +x, picture's down along -y.
        """
        return np.asarray(turned_axes(self.yaw_rad, self.tilt_x_rad, self.tilt_y_rad) @ _DOWN)

    @classmethod
    def load(cls, path: Path | str) -> "OverheadCamera":
        """Read the camera's JSON file.

        Raises:
            FileError: The file is missing, no JSON, or a key is missing or impossible.
        """
        return cls.parse(read_bytes(Path(path)), Path(path))

    @classmethod
    def parse(cls, data: bytes, path: Path, known: Mapping[str, Any] | None = None) -> "OverheadCamera":
        """Read the content of the camera's JSON file.

        Args:
            data: The content.
            path: Its name, for messages.
            known: Stands in for keys that the file lacks.

        Raises:
            FileError: It is no JSON, or a key is missing or impossible.
        """
        return made_of_json(data, path, lambda found: cls.from_mapping({**(known or {}), **found}))

    @classmethod
    def from_mapping(cls, data: Mapping[str, Any]) -> "OverheadCamera":
        """Make one from the keys of the JSON file.

        Raises:
            ValueError: A key is missing, unknown or impossible; the message names it.
        """
        unknown = set(data) - {*_SIDES, *_SINGLE, *_LISTS}
        if unknown:
            raise ValueError(f"'{min(unknown)}' is no key of an overhead camera")
        width, height = (whole_number(data, key) for key in _SIDES)
        k1, k2, p1, p2, k3 = numbers(data, "dist_k1_k2_p1_p2_k3", 5)
        x, y, z = numbers(data, "position_table_m", 3)
        return cls(
            width=width,
            height=height,
            **{key: number(data, key) for key in _SINGLE},
            distortion=(k1, k2, p1, p2, k3),
            position_table_m=(x, y, z),
        )

    def to_mapping(self) -> dict[str, Any]:
        """Give the keys of the JSON file."""
        lens, pose = _SINGLE[:4], _SINGLE[4:]
        return {
            **{key: getattr(self, key) for key in (*_SIDES, *lens)},
            "dist_k1_k2_p1_p2_k3": list(self.distortion),
            "position_table_m": list(self.position_table_m),
            **{key: getattr(self, key) for key in pose},
        }
