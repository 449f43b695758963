"""Where the camera over the table sees a point of the laboratory.

The emulator's own projection, written from OpenCV's published model (documentation of `calib3d`) and kept
apart from the ground station's, so that neither can agree with the other's mistake.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

_INVERSION_STEPS = 60


@dataclass(frozen=True)
class OverheadOptics:
    """A camera fixed over the table: pinhole, OpenCV distortion, place and attitude.

    Attributes:
        width_px: Columns of the picture.
        height_px: Rows of the picture.
        focal_px: (fx, fy).
        centre_px: (cx, cy).
        distortion: (k1, k2, p1, p2, k3) of OpenCV's model.
        position_m: Optical centre in the table frame, z up from the table's surface.
        yaw_rad: The camera axes in the table frame are the columns of `Rz(yaw) Rx(tilt_x) Ry(tilt_y) D`;
            D = diag(1, -1, -1) looks straight down with the picture's right along +x.
        tilt_x_rad: See `yaw_rad`.
        tilt_y_rad: See `yaw_rad`.

    Raises:
        ValueError: A size, focal length or height that is not positive.
    """

    width_px: int
    height_px: int
    focal_px: tuple[float, float]
    centre_px: tuple[float, float]
    distortion: tuple[float, float, float, float, float]
    position_m: tuple[float, float, float]
    yaw_rad: float = 0.0
    tilt_x_rad: float = 0.0
    tilt_y_rad: float = 0.0

    def __post_init__(self) -> None:
        if min(self.width_px, self.height_px, *self.focal_px, self.position_m[2]) <= 0:
            raise ValueError("width, height, focal lengths and height above the table must be positive")

    @cached_property
    def camera_from_table(self) -> Floats:
        """Rotation (3, 3) from table axes to camera axes."""
        turn = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        nod = math.cos(self.tilt_x_rad), math.sin(self.tilt_x_rad)
        roll = math.cos(self.tilt_y_rad), math.sin(self.tilt_y_rad)
        flip = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]])
        unroll = np.array([[roll[0], 0.0, -roll[1]], [0.0, 1.0, 0.0], [roll[1], 0.0, roll[0]]])
        unnod = np.array([[1.0, 0.0, 0.0], [0.0, nod[0], nod[1]], [0.0, -nod[1], nod[0]]])
        unturn = np.array([[turn[0], turn[1], 0.0], [-turn[1], turn[0], 0.0], [0.0, 0.0, 1.0]])
        return np.asarray(flip @ unroll @ unnod @ unturn)

    def project(self, points_m: ArrayLike) -> Floats:
        """Pixels (n, 2) of points (n, 3) of the table frame; pixel (0, 0) is the top-left pixel's centre."""
        seen = (np.asarray(points_m, dtype=float) - self.position_m) @ self.camera_from_table.T
        return self._distort(seen[:, :2] / seen[:, 2:]) * self.focal_px + self.centre_px

    def on_plane(self, pixels: ArrayLike, height_m: float) -> tuple[Floats, Floats]:
        """Points (n, 2) of the plane at a height that pixels (n, 2) see, and the rays' cosines off axis."""
        bent = (np.asarray(pixels, dtype=float) - self.centre_px) / self.focal_px
        slope = bent.copy()
        for _ in range(_INVERSION_STEPS):  # a contraction for every lens mild enough for the model
            slope += bent - self._distort(slope)
        ray = np.column_stack([slope, np.ones(len(slope))]) @ self.camera_from_table
        reach = (height_m - self.position_m[2]) / ray[:, 2]
        cosine = 1.0 / np.linalg.norm(ray, axis=1)
        return np.asarray(self.position_m[:2] + reach[:, None] * ray[:, :2]), cosine

    def _distort(self, slope: Floats) -> Floats:
        k1, k2, p1, p2, k3 = self.distortion
        x, y = slope[:, 0], slope[:, 1]
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        return np.column_stack(
            [
                x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
                y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
            ]
        )
