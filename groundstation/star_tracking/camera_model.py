"""How one star camera sees: intrinsics, lens distortion, and how it is bolted to the body.

Frames: ``camera`` is OpenCV's (x right, y down, z forward, origin in the optical centre); ``body`` is
the vehicle's. The mount is ``body_from_camera = Rz(yaw) Rx(tilt_x) Ry(tilt_y)``, whose columns are
the camera axes in the body frame: looking up with image right along body x.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.files.json_file import made_of_json
from groundstation.files.reading import read_bytes
from groundstation.files.values import check_amount, number, numbers, whole_number
from groundstation.frames import turned_axes

_SCALARS = (
    "fx",
    "fy",
    "cx",
    "cy",
    "ceiling_height_above_camera_m",
    "mount_yaw_rad",
    "mount_tilt_x_rad",
    "mount_tilt_y_rad",
)
_MOST_PX = 1e5  # of sides and focal lengths: larger pictures end in no memory
_MOST_DISTORTION = 100.0
_HIGHEST_M, _FARTHEST_M, _MOST_YAW_RAD = 100.0, 10.0, 7.0
_MAX_TILT_RAD = 0.5  # beyond this the ceiling leaves the picture: the file means degrees


@dataclass(frozen=True, slots=True)
class CameraCalibration:
    """One star camera, as calibrated.

    Attributes:
        width: Columns of a frame, px.
        height: Rows of a frame, px.
        fx: Focal length along the rows, px.
        fy: Focal length along the columns, px.
        cx: Principal point, px; pixel (0, 0) is the centre of the top-left pixel.
        cy: Principal point, px.
        distortion: k1, k2, p1, p2, k3 of OpenCV's model.
        ceiling_height_above_camera_m: Plane of the LEDs above the optical centre.
        mount_offset_body_m: Optical centre in the body frame (x, y, z).
        mount_yaw_rad: Mount rotation about body z.
        mount_tilt_x_rad: Mount rotation about the yawed x axis.
        mount_tilt_y_rad: Mount rotation about the axis y that results.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, float, float, float, float]
    ceiling_height_above_camera_m: float
    mount_offset_body_m: tuple[float, float, float]
    mount_yaw_rad: float = 0.0
    mount_tilt_x_rad: float = 0.0
    mount_tilt_y_rad: float = 0.0

    def __post_init__(self) -> None:
        if self.width < 16 or self.height < 16:
            raise ValueError(f"width and height must be at least 16 px, not {self.width} x {self.height}")
        if not (self.fx > 0.0 and self.fy > 0.0):
            raise ValueError(f"fx and fy must be positive, not {self.fx} and {self.fy}")
        if not self.ceiling_height_above_camera_m > 0.0:
            raise ValueError(
                f"ceiling_height_above_camera_m must be positive, not {self.ceiling_height_above_camera_m}"
            )
        for name in ("width", "height", "fx", "fy", "cx", "cy"):
            check_amount(name, getattr(self, name), _MOST_PX)
        for value in self.distortion:
            check_amount("dist_k1_k2_p1_p2_k3", value, _MOST_DISTORTION)
        check_amount(
            "ceiling_height_above_camera_m", self.ceiling_height_above_camera_m, _HIGHEST_M, "is it in mm?"
        )
        for value in self.mount_offset_body_m:
            check_amount("mount_offset_body_m", value, _FARTHEST_M, "is it in mm?")
        check_amount("mount_yaw_rad", self.mount_yaw_rad, _MOST_YAW_RAD, "is it in degrees?")
        for name in ("mount_tilt_x_rad", "mount_tilt_y_rad"):
            if abs(getattr(self, name)) > _MAX_TILT_RAD:
                raise ValueError(f"{name} must lie within +-{_MAX_TILT_RAD} rad, not {getattr(self, name)}")

    @property
    def matrix_px(self) -> NDArray[np.float64]:
        """Camera matrix, (3, 3), px."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    def body_from_camera(self) -> NDArray[np.float64]:
        """Rotation matrix (3, 3): columns are the camera axes in the body frame."""
        return turned_axes(self.mount_yaw_rad, self.mount_tilt_x_rad, self.mount_tilt_y_rad)

    @classmethod
    def load(cls, path: Path | str) -> "CameraCalibration":
        """Read ``camera.json``.

        Raises:
            FileError: The file is missing, no JSON, or a key is missing or impossible.
        """
        return cls.parse(read_bytes(Path(path)), Path(path))

    @classmethod
    def parse(cls, data: bytes, path: Path) -> "CameraCalibration":
        """Read the content of ``camera.json``.

        Raises:
            FileError: It is no JSON, or a key is missing or impossible.
        """
        return made_of_json(data, path, cls.from_mapping)

    @classmethod
    def from_mapping(cls, data: Mapping[str, Any]) -> "CameraCalibration":
        """Make one from the keys of ``camera.json``.

        Raises:
            ValueError: A key is missing or its value is not of its kind; the message names the key.
        """
        k1, k2, p1, p2, k3 = numbers(data, "dist_k1_k2_p1_p2_k3", 5)
        x, y, z = numbers(data, "mount_offset_body_m", 3)
        return cls(
            width=whole_number(data, "width"),
            height=whole_number(data, "height"),
            distortion=(k1, k2, p1, p2, k3),
            mount_offset_body_m=(x, y, z),
            **{key: number(data, key) for key in _SCALARS},
        )

    def to_mapping(self) -> dict[str, Any]:
        """Give the keys of ``camera.json``."""
        return {
            "width": self.width,
            "height": self.height,
            "fx": self.fx,
            "fy": self.fy,
            "cx": self.cx,
            "cy": self.cy,
            "dist_k1_k2_p1_p2_k3": list(self.distortion),
            "ceiling_height_above_camera_m": self.ceiling_height_above_camera_m,
            "mount_offset_body_m": list(self.mount_offset_body_m),
            "mount_yaw_rad": self.mount_yaw_rad,
            "mount_tilt_x_rad": self.mount_tilt_x_rad,
            "mount_tilt_y_rad": self.mount_tilt_y_rad,
        }

    def with_height(self, ceiling_height_above_camera_m: float) -> "CameraCalibration":
        """Give the same camera under a ceiling of another height."""
        return replace(self, ceiling_height_above_camera_m=ceiling_height_above_camera_m)
