"""Pictures of a craft: disks, box and lines drawn on a grid finer than the pixels, noise, rounding.

No diffraction, no motion in the exposure, no point hides another.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.laboratory.separations import TargetLooks

Floats = NDArray[np.float64]
Picture = NDArray[np.uint8]

_FINE = 12
"""Points a side that a pixel is counted on."""
_SHIFT = 4  # binary digits of a pixel that OpenCV's polygons take
_GLARE_GROWS_S = 0.25
_GLARE_PX = 260.0  # one sigma of its halo when it has grown


class Painter:
    """Paints one craft.

    Args:
        looks: Of it.
        points_body_m: (k, 3).
        f_px: Focal length.
        size_px: Columns and rows.
        seed: Of the noise.
    """

    def __init__(
        self, looks: TargetLooks, points_body_m: Floats, f_px: float, size_px: tuple[int, int], seed: int
    ) -> None:
        self._looks, self._points, self._f_px, self._size, self._seed = (
            looks,
            points_body_m,
            f_px,
            size_px,
            seed,
        )
        self._middle = 0.5 * (np.array(size_px) - 1.0)

    def pixels(self, points_camera_m: Floats) -> Floats:
        """Project points (..., 3); NaN behind the camera."""
        depth = np.where(points_camera_m[..., 2:] > 0.0, points_camera_m[..., 2:], np.nan)
        found: Floats = self._f_px * points_camera_m[..., :2] / depth + self._middle
        return found

    def paint(self, rotation: Floats, position_m: Floats, t_s: float, number: int) -> Picture:
        """The picture of a pose: rotation (3, 3) and position (3,) in camera axes."""
        looks = self._looks
        sky = np.full(self._size[::-1], looks.background)
        if looks.body_half_m is not None:
            self._draw_body(sky, looks.body_half_m, rotation, position_m)
        seen = self._points @ rotation.T + position_m
        for pixel, depth in zip(self.pixels(seen), seen[:, 2], strict=True):
            if depth > 0.0:
                radius = 0.5 * looks.tip_diameter_m * self._f_px / depth
                _lay(sky, looks.level, pixel, pixel, radius)
        if looks.glare_from_s is not None and t_s >= looks.glare_from_s:
            self._outshine(sky, position_m, min(1.0, (t_s - looks.glare_from_s) / _GLARE_GROWS_S))
        rng = np.random.default_rng([self._seed, number])
        noise = rng.standard_normal(sky.shape, np.float32)
        return np.asarray(np.clip(np.rint(sky + looks.noise * noise), 0.0, 255.0), dtype=np.uint8)

    def _draw_body(self, sky: Floats, half_m: Floats, rotation: Floats, position_m: Floats) -> None:
        looks = self._looks
        corners = np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).reshape(3, -1).T * half_m
        lines = [(point, looks.level) for point in looks.antennas]
        lines += [(point, looks.dim_level) for point in looks.dim_antennas]
        for point, level in lines:
            tip = self._points[point]
            root = np.clip(tip, -half_m, half_m)
            ends = np.stack((root, tip)) @ rotation.T + position_m
            radius = 0.5 * looks.antenna_width_m * self._f_px / float(ends[:, 2].mean())
            begin, end = self.pixels(ends)
            _lay(sky, level, begin, end, radius)
        outline = cv2.convexHull(self.pixels(corners @ rotation.T + position_m).astype(np.float32))
        fixed = np.rint(outline * 2.0**_SHIFT).astype(np.int32)
        cover = np.zeros(sky.shape, np.uint8)
        cv2.fillConvexPoly(cover, fixed, 255, cv2.LINE_AA, _SHIFT)
        share = cover / 255.0
        sky += share * (looks.body_level - sky)

    def _outshine(self, sky: Floats, position_m: Floats, grown: float) -> None:
        u, v = self.pixels(position_m)
        rows, columns = sky.shape
        reach = max(1.0, grown * _GLARE_PX)
        across = np.exp(-0.5 * ((np.arange(columns) - u) / reach) ** 2)
        down = np.exp(-0.5 * ((np.arange(rows) - v) / reach) ** 2)
        sky += 900.0 * down[:, None] * across


def _lay(sky: Floats, level: float, begin: Floats, end: Floats, radius: float) -> None:
    """Lay a line with round ends (a disk where both ends are one place) over what is there."""
    rows, columns = sky.shape
    low = np.floor(np.minimum(begin, end) - radius).astype(int)
    high = np.ceil(np.maximum(begin, end) + radius).astype(int) + 1
    left, top = max(0, low[0]), max(0, low[1])
    right, bottom = min(columns, high[0]), min(rows, high[1])
    if left >= right or top >= bottom:
        return
    offset = (np.arange(_FINE) + 0.5) / _FINE - 0.5
    x = (np.arange(left, right)[:, None] + offset).ravel()[None] - begin[0]
    y = (np.arange(top, bottom)[:, None] + offset).ravel()[:, None] - begin[1]
    dx, dy = end - begin
    length = dx * dx + dy * dy
    along = np.clip((x * dx + y * dy) / length, 0.0, 1.0) if length > 0.0 else 0.0
    inside = (x - along * dx) ** 2 + (y - along * dy) ** 2 < radius**2
    cover = inside.reshape(bottom - top, _FINE, right - left, _FINE).mean(axis=(1, 3))
    patch = sky[top:bottom, left:right]
    np.maximum(patch, patch + cover * (level - patch), out=patch)
