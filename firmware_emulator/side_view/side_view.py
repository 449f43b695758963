"""The grey picture of a camera on a hull: upright cylinders lit by the sun lamp, with shining markers.

The camera is levelled, so each column of the picture meets a cylinder at one depth: top, bottom and markers
cover its pixels by shares that are known in closed form, and no polygon is drawn. Bodies are painted from the
farthest to the nearest, so nearer ones hide what is behind them. What is simplified: table and walls are
black, a matte hull scatters by Lambert's law, no cast shadows, markers shine alike into all directions, a
global shutter, no lens distortion.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from firmware_emulator.side_view.scene import Hull, SideOptics
from firmware_emulator.sky.sensor import Sensor, SensorSettings

Floats = NDArray[np.float64]
Picture = NDArray[np.float32]
Pose = tuple[float, float, float]
"""x, y (m) and heading (rad) of the body origin in the table frame."""

FINE = 4
"""A column is the mean of so many."""
BLACK, WHITE = 0.04, 0.75
"""Share of the light that a hull with, and without markers scatters."""
MARKER_DN = 190.0
HAND_DN = 40.0
_LAMP_RADIUS_PX, _LAMP_DN, _HALO_PX, _HALO_DN = 18, 5000.0, 60.0, 140.0
_MOST_STEPS = 8
_GRAZING = 0.05
_MARGIN_PX = 2


@dataclass(frozen=True, slots=True)
class SunLamp:
    """The lamp that stands for the Sun, infinitely far away.

    Attributes:
        azimuth_rad: Direction towards the lamp in the table, counter-clockwise from +x.
        elevation_rad: Of that direction above the table.
        level_dn: Grey level of a white surface that faces the lamp.
        ambient_ratio: What comes from everywhere else, as a share of that.
    """

    azimuth_rad: float = 0.0
    elevation_rad: float = 0.3
    level_dn: float = 200.0
    ambient_ratio: float = 0.0


@dataclass(frozen=True, slots=True)
class _Seen:
    """A hull in camera axes: x right, z forward; turn of its body +x from the optical axis, to the left."""

    hull: Hull
    x_m: float
    z_m: float
    turn_rad: float


class SideView:
    """Draws what one side camera sees.

    Args:
        optics: The camera.
        hulls: Of all that may be seen, by name.
        lamp: What lights them.
        seed: Decides noise and hot pixels.
    """

    PSF_SIGMA_PX = 0.8

    def __init__(
        self, optics: SideOptics, hulls: Mapping[str, Hull], lamp: SunLamp, seed: np.random.SeedSequence
    ) -> None:
        self._optics, self._hulls, self._lamp = optics, dict(hulls), lamp
        settings = SensorSettings(hot_pixels=12)
        self._sensor = Sensor(settings, optics.height_px, optics.width_px, seed)

    def render(
        self,
        own: tuple[Pose, Pose],
        others: Mapping[str, tuple[Pose, Pose]],
        sequence: int,
        *,
        is_dark: bool = False,
        covered_share: float = 0.0,
    ) -> NDArray[np.uint8]:
        """One picture.

        Args:
            own: Pose of the mock-up that carries the camera, when the shutter opened and closed.
            others: The same of the other mock-ups.
            sequence: Decides the noise.
            is_dark: Lamp and markers are off.
            covered_share: Of the columns, from the left, that a hand in front of the lens covers.

        Returns:
            uint8 (height, width).
        """
        optics = self._optics
        light = np.zeros((optics.height_px, optics.width_px), np.float32)
        if not is_dark:
            steps = self._steps(own, others)
            for step in range(steps):
                share = (step + 0.5) / steps
                poses = {name: _between(path, share) for name, path in others.items()}
                light += self._moment(_between(own, share), poses) / np.float32(steps)
        columns = round(covered_share * optics.width_px)
        light[:, :columns] = HAND_DN
        cv2.GaussianBlur(light, (0, 0), self.PSF_SIGMA_PX, dst=light)
        return self._sensor.expose(light, sequence)

    def _moment(self, own: Pose, others: Mapping[str, Pose]) -> Picture:
        """The light of one moment, (rows, columns)."""
        axis_rad = own[2] + self._optics.yaw_rad
        sun = self._towards_lamp(axis_rad)
        light = self._lamp_in_view(sun)
        seen = [self._in_camera(name, pose, own, axis_rad) for name, pose in others.items()]
        in_front = [body for body in seen if body.z_m > body.hull.radius_m]
        in_front.sort(key=lambda body: -math.hypot(body.x_m, body.z_m))
        boxes = [box for body in in_front if (box := self._box(body)) is not None]
        if not boxes:
            return light
        left, top = min(box[0] for box in boxes), min(box[1] for box in boxes)
        right, bottom = max(box[2] for box in boxes), max(box[3] for box in boxes)
        fine_u = left - 0.5 + (np.arange((right - left) * FINE) + 0.5) / FINE
        rows = np.arange(top, bottom, dtype=np.float32)
        canvas = np.repeat(light[top:bottom, left:right], FINE, axis=1)
        for body in in_front:
            self._paint(canvas, fine_u, rows, body, sun)
        light[top:bottom, left:right] = canvas.reshape(len(rows), right - left, FINE).mean(axis=2)
        return light

    def _paint(
        self, canvas: Picture, fine_u: Floats, rows: Picture, body: _Seen, sun: tuple[float, float, float]
    ) -> None:
        """Lay one cylinder over the canvas (rows, fine columns)."""
        optics, hull = self._optics, body.hull
        slope = (fine_u - optics.centre_px[0]) / optics.focal_px
        # the nearer point where the ray (slope, 1) Z meets the circle about (x, z)
        a, b = 1.0 + slope**2, slope * body.x_m + body.z_m
        under = b * b - a * (body.x_m**2 + body.z_m**2 - hull.radius_m**2)
        low_u, high_u = self._limbs(body)
        step_px = 1.0 / FINE
        wide = np.minimum(fine_u + 0.5 * step_px, high_u) - np.maximum(fine_u - 0.5 * step_px, low_u)
        columns = np.flatnonzero(wide > 0.0)
        if not len(columns):
            return
        slope = slope[columns]
        depth_m = (b[columns] - np.sqrt(np.maximum(under[columns], 0.0))) / a[columns]
        normal_x = (slope * depth_m - body.x_m) / hull.radius_m
        normal_z = (depth_m - body.z_m) / hull.radius_m
        lit = np.maximum(0.0, normal_x * sun[0] + normal_z * sun[2]) + self._lamp.ambient_ratio
        level = np.float32((BLACK if hull.markers else WHITE) * self._lamp.level_dn) * lit.astype(np.float32)
        covered = self._coverage(rows, depth_m, hull.bottom_m, hull.top_m)
        covered *= (wide[columns] / step_px).astype(np.float32)  # of the columns that a limb cuts
        shown = covered * level
        # where around the hull each column looks, counter-clockwise seen from above, from body +x
        around = np.arctan2(-normal_x, normal_z) - body.turn_rad
        for marker in hull.markers:
            off_m = hull.radius_m * ((around - marker.azimuth_rad + math.pi) % (2.0 * math.pi) - math.pi)
            on = np.flatnonzero(np.abs(off_m) < hull.marker_radius_m)
            if not len(on):
                continue
            half_m = np.sqrt(hull.marker_radius_m**2 - off_m[on] ** 2)
            disc = self._coverage(rows, depth_m[on], marker.height_m - half_m, marker.height_m + half_m)
            span = slice(int(on[0]), int(on[-1]) + 1)
            shown[:, span] += disc * (np.float32(MARKER_DN) - level[span])
        span = slice(int(columns[0]), int(columns[-1]) + 1)
        canvas[:, span] *= np.float32(1.0) - covered
        canvas[:, span] += shown

    def _coverage(
        self, rows: Picture, depth_m: Floats, low_m: Floats | float, high_m: Floats | float
    ) -> Picture:
        """Share of each pixel (rows, columns) between two heights at the depth of its column."""
        scale = self._optics.focal_px / depth_m
        eye_m = self._optics.position_body_m[2]
        upper = self._optics.centre_px[1] + scale * (eye_m - high_m)
        lower = self._optics.centre_px[1] + scale * (eye_m - low_m)
        half = np.float32(0.5)
        ends, begins = lower.astype(np.float32), upper.astype(np.float32)
        share: Picture = np.minimum(rows[:, None] + half, ends)
        share -= np.maximum(rows[:, None] - half, begins)
        return np.clip(share, np.float32(0.0), np.float32(1.0), out=share)

    def _in_camera(self, name: str, pose: Pose, own: Pose, axis_rad: float) -> _Seen:
        along, across, _ = self._optics.position_body_m
        cosine, sine = math.cos(own[2]), math.sin(own[2])
        dx = pose[0] - (own[0] + cosine * along - sine * across)
        dy = pose[1] - (own[1] + sine * along + cosine * across)
        ahead, right = (math.cos(axis_rad), math.sin(axis_rad)), (math.sin(axis_rad), -math.cos(axis_rad))
        return _Seen(
            self._hulls[name],
            dx * right[0] + dy * right[1],
            dx * ahead[0] + dy * ahead[1],
            pose[2] - axis_rad,
        )

    def _limbs(self, body: _Seen) -> tuple[float, float]:
        """Columns at which the cylinder ends on the left and on the right."""
        optics = self._optics
        far_m = math.hypot(body.x_m, body.z_m)
        middle, half = math.atan2(body.x_m, body.z_m), math.asin(min(1.0, body.hull.radius_m / far_m))
        low_u, high_u = (
            optics.centre_px[0] + optics.focal_px * math.tan(max(-1.5, min(1.5, middle + side * half)))
            for side in (-1.0, 1.0)
        )
        return low_u, high_u

    def _box(self, body: _Seen) -> tuple[int, int, int, int] | None:
        """Left, top, right, bottom of what may be painted of a hull; None if it is out of view."""
        optics, hull = self._optics, body.hull
        ends = self._limbs(body)
        scale = optics.focal_px / max(body.z_m - hull.radius_m, 1e-3)
        eye_m, cy = optics.position_body_m[2], optics.centre_px[1]
        heights = [cy + scale * (eye_m - hull.top_m), cy + scale * (eye_m - hull.bottom_m), cy]
        left = int(min(max(math.floor(ends[0]) - _MARGIN_PX, 0), optics.width_px))
        right = int(min(max(math.ceil(ends[1]) + _MARGIN_PX, 0), optics.width_px))
        top = int(min(max(math.floor(min(heights)) - _MARGIN_PX, 0), optics.height_px))
        bottom = int(min(max(math.ceil(max(heights)) + _MARGIN_PX, 0), optics.height_px))
        return (left, top, right, bottom) if left < right and top < bottom else None

    def _towards_lamp(self, axis_rad: float) -> tuple[float, float, float]:
        """Unit vector towards the lamp: right, up, forward."""
        flat, bearing_rad = math.cos(self._lamp.elevation_rad), self._lamp.azimuth_rad - axis_rad
        return (
            -flat * math.sin(bearing_rad),
            math.sin(self._lamp.elevation_rad),
            flat * math.cos(bearing_rad),
        )

    def _lamp_in_view(self, sun: tuple[float, float, float]) -> Picture:
        """The lamp itself with its halo where the camera looks at it, (rows, columns)."""
        optics = self._optics
        light = np.zeros((optics.height_px, optics.width_px), np.float32)
        if sun[2] <= _GRAZING or self._lamp.level_dn == 0.0:
            return light
        u = optics.centre_px[0] + optics.focal_px * sun[0] / sun[2]
        v = optics.centre_px[1] - optics.focal_px * sun[1] / sun[2]
        reach = 3.0 * _HALO_PX
        if -reach < u < optics.width_px + reach and -reach < v < optics.height_px + reach:
            row, column = np.ogrid[: optics.height_px, : optics.width_px]
            squared = (column - u) ** 2 + (row - v) ** 2
            light += _HALO_DN * np.exp(-0.5 * squared / _HALO_PX**2)
            light += _LAMP_DN * (squared < _LAMP_RADIUS_PX**2)
        return light

    def _steps(self, own: tuple[Pose, Pose], others: Mapping[str, tuple[Pose, Pose]]) -> int:
        """Enough moments of the exposure that none is half a pixel from the next."""
        focal_px = self._optics.focal_px
        turn_px = focal_px * abs(_turn(own))
        way_px = max(
            (
                focal_px * math.hypot(*_moved(own, path)) / max(math.dist(own[0][:2], path[0][:2]) - 0.3, 0.1)
                for path in others.values()
            ),
            default=0.0,
        )
        return int(min(_MOST_STEPS, 1 + math.floor(2.0 * (turn_px + way_px))))


def _turn(path: tuple[Pose, Pose]) -> float:
    return (path[1][2] - path[0][2] + math.pi) % (2.0 * math.pi) - math.pi


def _moved(one: tuple[Pose, Pose], other: tuple[Pose, Pose]) -> tuple[float, float]:
    """How one has moved against the other."""
    (ax, ay, _), (bx, by, _) = one
    (cx, cy, _), (dx, dy, _) = other
    return bx - ax - dx + cx, by - ay - dy + cy


def _between(path: tuple[Pose, Pose], share: float) -> Pose:
    start, end = path
    return (
        start[0] + share * (end[0] - start[0]),
        start[1] + share * (end[1] - start[1]),
        start[2] + share * _turn(path),
    )
