"""From a pixel to the ceiling: the full camera model, as a table.

``q(u, v)`` is the point of the ceiling plane that a pixel sees, relative to the body origin and along
the body's axes, for a level body. Then ``star = position + R(heading) q``: what distortion, mount and
height do is done here once, and identification is a rigid motion in the plane.

The table holds q and its derivatives on every second pixel; between them a first-order step is good
to 5e-4 px for any lens whose distortion a webcam could have.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from groundstation.star_tracking.camera_model import CameraCalibration

_STEP_PX = 2
_NEWTON_STEPS = 8


@dataclass(frozen=True, slots=True, eq=False)
class CeilingPoints:
    """Where spots are on the ceiling, body axes.

    Attributes:
        q_body_m: Points as complex numbers x + iy, shape (n,), m.
        jacobian_m_px: Derivative of (x, y) by (u, v), shape (n, 2, 2).
    """

    q_body_m: NDArray[np.complex128]
    jacobian_m_px: NDArray[np.float64]


def spot_covariance(points: CeilingPoints, covariance_px2: NDArray[np.float64]) -> NDArray[np.float64]:
    """Carry pixel covariances (n, 3: uu, uv, vv) to the ceiling, shape (n, 2, 2), m^2."""
    pixel = np.empty((len(covariance_px2), 2, 2))
    pixel[:, 0, 0], pixel[:, 1, 1] = covariance_px2[:, 0], covariance_px2[:, 2]
    pixel[:, 0, 1] = pixel[:, 1, 0] = covariance_px2[:, 1]
    jacobian = points.jacobian_m_px
    return np.asarray(jacobian @ pixel @ jacobian.transpose(0, 2, 1))


class CeilingRays:
    """Pixel to ceiling for one calibrated camera.

    Attributes:
        camera: The calibration behind the table.
        scale_m_px: Length on the ceiling of one pixel near the axis.
        reach_m: Longest distance between two points of one picture.
        table: q_x, q_y and their derivatives dx/du, dx/dv, dy/du, dy/dv; shape (rows * columns, 6).
        columns: Entries of the table along u, one every step_px.
        rows: Entries along v.
        step_px: Pixels between entries.
    """

    def __init__(self, camera: CameraCalibration) -> None:
        self.camera = camera
        self.scale_m_px = camera.ceiling_height_above_camera_m / (0.5 * (camera.fx + camera.fy))
        self.step_px = _STEP_PX
        self.columns = (camera.width - 1) // _STEP_PX + 1
        self.rows = (camera.height - 1) // _STEP_PX + 1
        u, v = np.meshgrid(np.arange(self.columns) * float(_STEP_PX), np.arange(self.rows) * float(_STEP_PX))
        q, jacobian = ceiling_points(camera, u.ravel(), v.ravel())
        self.table = np.concatenate((q, jacobian.reshape(-1, 4)), axis=1)
        corners = q[[0, self.columns - 1, -self.columns, -1]]
        self.reach_m = float(np.max(np.linalg.norm(corners[:, None] - corners[None], axis=2)))

    def look_up(self, u_px: NDArray[np.float64], v_px: NDArray[np.float64]) -> CeilingPoints:
        """Give ceiling points for pixels inside the picture, shapes (n,)."""
        column = np.clip(np.rint(u_px * (1.0 / _STEP_PX)), 0, self.columns - 1).astype(np.intp)
        row = np.clip(np.rint(v_px * (1.0 / _STEP_PX)), 0, self.rows - 1).astype(np.intp)
        entry = self.table[row * self.columns + column]
        du, dv = u_px - _STEP_PX * column, v_px - _STEP_PX * row
        q = np.empty(len(du), dtype=np.complex128)
        q.real = entry[:, 0] + entry[:, 2] * du + entry[:, 3] * dv
        q.imag = entry[:, 1] + entry[:, 4] * du + entry[:, 5] * dv
        return CeilingPoints(q, entry[:, 2:].reshape(-1, 2, 2))


def ceiling_points(
    camera: CameraCalibration, u_px: NDArray[np.float64], v_px: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Give exact ceiling points (n, 2) in m and their derivatives by pixel (n, 2, 2)."""
    x, y, d_normal = undistort(camera, u_px, v_px)
    rotation = camera.body_from_camera()
    ray = np.stack((x, y, np.ones_like(x)), axis=-1) @ rotation.T
    height = camera.ceiling_height_above_camera_m
    q = height * ray[:, :2] / ray[:, 2:] + np.asarray(camera.mount_offset_body_m[:2])
    # d(ray_xy / ray_z) = (d ray_xy - ray_xy / ray_z d ray_z) / ray_z
    d_ray = rotation[:, :2][None] @ d_normal
    ratio = ray[:, :2] / ray[:, 2:]
    jacobian = height * (d_ray[:, :2] - ratio[:, :, None] * d_ray[:, 2:3]) / ray[:, 2][:, None, None]
    return q, jacobian


class Lens(Protocol):
    """What distortion needs of a camera: focal lengths and centre in px, k1, k2, p1, p2, k3."""

    @property
    def fx(self) -> float: ...
    @property
    def fy(self) -> float: ...
    @property
    def cx(self) -> float: ...
    @property
    def cy(self) -> float: ...
    @property
    def distortion(self) -> tuple[float, float, float, float, float]: ...


def undistort(
    camera: Lens, u_px: NDArray[np.float64], v_px: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Invert OpenCV's distortion by Newton's method.

    Returns:
        Undistorted normalised x and y, shape (n,), and their derivatives by pixel (n, 2, 2).
    """
    goal_x, goal_y = (u_px - camera.cx) / camera.fx, (v_px - camera.cy) / camera.fy
    x, y = goal_x.copy(), goal_y.copy()
    for _ in range(_NEWTON_STEPS):
        seen_x, seen_y, d = distort(camera, x, y)
        ex, ey = goal_x - seen_x, goal_y - seen_y
        det = d[:, 0, 0] * d[:, 1, 1] - d[:, 0, 1] * d[:, 1, 0]
        x = x + (d[:, 1, 1] * ex - d[:, 0, 1] * ey) / det
        y = y + (d[:, 0, 0] * ey - d[:, 1, 0] * ex) / det
        if max(float(np.max(np.abs(ex))), float(np.max(np.abs(ey)))) < 1e-12:
            break
    _, _, d = distort(camera, x, y)
    det = d[:, 0, 0] * d[:, 1, 1] - d[:, 0, 1] * d[:, 1, 0]
    by_pixel = np.empty_like(d)
    by_pixel[:, 0, 0], by_pixel[:, 0, 1] = d[:, 1, 1] / (det * camera.fx), -d[:, 0, 1] / (det * camera.fy)
    by_pixel[:, 1, 0], by_pixel[:, 1, 1] = -d[:, 1, 0] / (det * camera.fx), d[:, 0, 0] / (det * camera.fy)
    return x, y, by_pixel


def distort(
    camera: Lens, x: NDArray[np.float64], y: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Apply k1, k2, p1, p2, k3 to normalised coordinates; give the derivatives (n, 2, 2) too."""
    k1, k2, p1, p2, k3 = camera.distortion
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    slope = 2.0 * (k1 + r2 * (2.0 * k2 + 3.0 * r2 * k3))  # d radial / d x = slope * x
    seen_x = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
    seen_y = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y
    d = np.empty((len(x), 2, 2))
    d[:, 0, 0] = radial + slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x
    d[:, 0, 1] = slope * x * y + 2.0 * p1 * x + 2.0 * p2 * y
    d[:, 1, 0] = d[:, 0, 1]
    d[:, 1, 1] = radial + slope * y * y + 6.0 * p1 * y + 2.0 * p2 * x
    return seen_x, seen_y, d
