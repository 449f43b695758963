"""Where the emulated camera sees a point of the ceiling.

The emulator's own projection, written from OpenCV's published model (documentation of `calib3d`) and kept
apart from the ground station's, so that neither can agree with the other's mistake.

Axes: camera x right, y down, z forward; pixel (0, 0) is the centre of the top-left pixel. The camera looks
up, so that (u, v) to ceiling (x, y) keeps handedness and turns by +heading.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import cos, sin

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

_BEYOND_CORNER = 1.1  # polynomial distortion folds back far outside the picture: cut off a little after it
_INVERSION_STEPS = 30


@dataclass(frozen=True)
class CameraOptics:
    """A camera on a mock-up: pinhole, OpenCV distortion, and how it is screwed on.

    Attributes:
        width_px: Columns of the picture.
        height_px: Rows of the picture.
        focal_px: (fx, fy).
        centre_px: (cx, cy).
        distortion: (k1, k2, p1, p2, k3) of OpenCV's model.
        ceiling_height_m: Ceiling above the optical centre.
        offset_body_m: Optical centre in the body frame (x, y).
        yaw_rad: The camera axes in the body frame are the columns of `Rz(yaw) Rx(tilt_x) Ry(tilt_y)`.
        tilt_x_rad: See `yaw_rad`.
        tilt_y_rad: See `yaw_rad`.

    Raises:
        ValueError: A size, focal length or height that is not positive, or a number that is not finite.
    """

    width_px: int
    height_px: int
    focal_px: tuple[float, float]
    centre_px: tuple[float, float]
    distortion: tuple[float, float, float, float, float]
    ceiling_height_m: float
    offset_body_m: tuple[float, float] = (0.0, 0.0)
    yaw_rad: float = 0.0
    tilt_x_rad: float = 0.0
    tilt_y_rad: float = 0.0

    def __post_init__(self) -> None:
        positive = (self.width_px, self.height_px, *self.focal_px, self.ceiling_height_m)
        others = (*self.centre_px, *self.distortion, *self.offset_body_m)
        angles = (self.yaw_rad, self.tilt_x_rad, self.tilt_y_rad)
        if not np.all(np.isfinite([*positive, *others, *angles])):
            raise ValueError("every number of a camera must be finite")
        if min(positive) <= 0:
            raise ValueError("width, height, focal lengths and ceiling height of a camera must be positive")
        if len(self.distortion) != 5:
            raise ValueError("distortion has five coefficients: k1, k2, p1, p2, k3")

    @cached_property
    def body_from_camera(self) -> Floats:
        """Rotation (3, 3) whose columns are the camera axes in the body frame."""
        cz, sz = cos(self.yaw_rad), sin(self.yaw_rad)
        cx, sx = cos(self.tilt_x_rad), sin(self.tilt_x_rad)
        cy, sy = cos(self.tilt_y_rad), sin(self.tilt_y_rad)
        return np.array(
            [
                [cz * cy - sz * sx * sy, -sz * cx, cz * sy + sz * sx * cy],
                [sz * cy + cz * sx * sy, cz * cx, sz * sy - cz * sx * cy],
                [-cx * sy, sx, cx * cy],
            ]
        )

    def project(self, ceiling_xy_m: ArrayLike, pose: Sequence[ArrayLike]) -> tuple[Floats, Floats]:
        """Where points of the ceiling appear.

        Args:
            ceiling_xy_m: Points, shape (..., 2), table axes.
            pose: x, y (m) and heading (rad) of the body origin; numbers or arrays that broadcast with (...).

        Returns:
            Pixels (..., 2), and the cosine (...) of each ray's angle to the optical axis. Pixels are NaN for
            points that are behind the camera or so far off axis that the distortion model means nothing.
        """
        points = np.asarray(ceiling_xy_m, dtype=float)
        x, y, heading = (np.asarray(part, dtype=float) for part in pose)
        dx, dy = points[..., 0] - x, points[..., 1] - y
        c, s = np.cos(heading), np.sin(heading)
        body = np.empty((*np.broadcast_shapes(dx.shape, c.shape), 3))
        body[..., 0] = c * dx + s * dy - self.offset_body_m[0]
        body[..., 1] = c * dy - s * dx - self.offset_body_m[1]
        body[..., 2] = self.ceiling_height_m
        ray = body @ self.body_from_camera
        depth = ray[..., 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = ray[..., :2] / depth[..., None]
        lost = (depth <= 0.0) | ~(np.sum(slope**2, axis=-1) < self._limit**2)
        slope = np.where(lost[..., None], np.nan, slope)
        pixels = self._distort(slope) * self.focal_px + self.centre_px
        return pixels, depth / np.linalg.norm(ray, axis=-1)

    def ceiling_in_body(self, pixels: ArrayLike) -> tuple[Floats, Floats]:
        """Points of the ceiling that pixels look at, from a level body: the inverse of `project`.

        Args:
            pixels: Shape (n, 2), inside the picture.

        Returns:
            Points (n, 2) relative to the body origin, body axes (m), and the cosine (n,) of each ray's angle
            to the optical axis.
        """
        slope = self._undistort((np.asarray(pixels, dtype=float) - self.centre_px) / self.focal_px)
        ray = np.column_stack([slope, np.ones(len(slope))])
        body = ray @ self.body_from_camera.T
        on_ceiling = body[:, :2] * (self.ceiling_height_m / body[:, 2:])
        return on_ceiling + self.offset_body_m, 1.0 / np.linalg.norm(ray, axis=1)

    def footprint_m2(self) -> float:
        """Area of the ceiling in the picture (of the quadrilateral through the picture's corners)."""
        (x, y) = self.ceiling_in_body(self._corners_px())[0].T
        return float(0.5 * abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))))

    @cached_property
    def _limit(self) -> float:
        """Largest slope of a ray, off the optical axis, for which the distortion model is believed."""
        corners = self._undistort((self._corners_px() - self.centre_px) / self.focal_px)
        return _BEYOND_CORNER * float(np.max(np.linalg.norm(corners, axis=1)))

    def _corners_px(self) -> Floats:
        right, bottom = self.width_px - 1.0, self.height_px - 1.0
        return np.array([[0.0, 0.0], [right, 0.0], [right, bottom], [0.0, bottom]])

    def _distort(self, slope: Floats) -> Floats:
        k1, k2, p1, p2, k3 = self.distortion
        x, y = slope[..., 0], slope[..., 1]
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        bent = np.empty_like(slope)
        bent[..., 0] = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
        bent[..., 1] = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y
        return bent

    def _undistort(self, bent: Floats) -> Floats:
        slope = bent.copy()
        for _ in range(_INVERSION_STEPS):  # a contraction for every lens mild enough for the model
            slope += bent - self._distort(slope)
        return slope
