"""From a motion-capture system's frame to poses on the table. Pure.

The system's frame is right-handed with y or z up; z up and no yaw, its axes are the table's. A y-up system
lies with its x along the table's x and its z along the table's -y. Assumes that system and table are level
to each other; what a mock-up is tilted by is reported, not used.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from groundstation.frames import wrap_angle

_UP = {"z": Rotation.identity(), "y": Rotation.from_euler("x", 90.0, degrees=True)}
"""Turns the system's axes into ones with z up."""


@dataclass(frozen=True, slots=True)
class TablePose:
    """A mock-up on the table.

    Attributes:
        x_m: Body origin, table frame.
        y_m: Body origin, table frame.
        heading_rad: In [-pi, pi).
        tilt_rad: Between the body's up axis and the table's.
    """

    x_m: float
    y_m: float
    heading_rad: float
    tilt_rad: float


class CaptureFrame:
    """How a system's frame lies to the table.

    Args:
        up: Which of its axes points up, ``y`` or ``z``.
        origin_table_m: Its origin in the table frame, (x, y, z).
        yaw_rad: From table +x to the system's +x, counter-clockwise seen from above.
    """

    def __init__(self, up: str, origin_table_m: tuple[float, float, float], yaw_rad: float) -> None:
        self._table_from_capture = Rotation.from_euler("z", yaw_rad) * _UP[up]
        self._origin_table_m: NDArray[np.float64] = np.array(origin_table_m, dtype=float)

    def pose(
        self,
        position_capture_m: tuple[float, float, float],
        quaternion_xyzw: tuple[float, float, float, float],
        pivot_body_m: tuple[float, float],
        pivot_yaw_rad: float,
        body_up: str = "z",
    ) -> TablePose:
        """The mock-up whose rigid body is seen.

        Args:
            position_capture_m: Of the pivot, system's frame.
            quaternion_xyzw: Turns the rigid body's axes into the system's.
            pivot_body_m: The pivot from the body origin, body axes (x, y).
            pivot_yaw_rad: From body +x to the rigid body's +x.
            body_up: Which axis of the rigid body points up when the mock-up lies flat.

        Raises:
            ValueError: The quaternion is not of length 1.
        """
        if abs(math.hypot(*quaternion_xyzw) - 1.0) > 1e-3:
            raise ValueError(f"a quaternion of length {math.hypot(*quaternion_xyzw):.3g}")
        turned = self._table_from_capture * Rotation.from_quat(quaternion_xyzw) * _UP[body_up].inv()
        axes = turned.as_matrix()
        heading_rad = wrap_angle(math.atan2(axes[1, 0], axes[0, 0]) - pivot_yaw_rad)
        tilt_rad = math.acos(min(1.0, max(-1.0, axes[2, 2])))
        pivot = self._origin_table_m + self._table_from_capture.apply(position_capture_m)
        cosine, sine = math.cos(heading_rad), math.sin(heading_rad)
        x_m = float(pivot[0]) - (cosine * pivot_body_m[0] - sine * pivot_body_m[1])
        y_m = float(pivot[1]) - (sine * pivot_body_m[0] + cosine * pivot_body_m[1])
        return TablePose(x_m, y_m, heading_rad, tilt_rad)
