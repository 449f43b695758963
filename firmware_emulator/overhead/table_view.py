"""The colour picture of the camera over the table: table, floor, mock-ups with their discs, hands.

Matter is an albedo per colour; a lamp of some colour lights it unevenly; the lens darkens to the edge and
blurs; one colour filter sits on each pixel (red, green / green, blue) and the camera's electronics make three
colours of it again. What is simplified: no cast shadows, no highlights, a global shutter, the floor lies as
high as the table.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from firmware_emulator.overhead.optics import Floats, OverheadOptics
from firmware_emulator.overhead.scene import Markings
from firmware_emulator.sky.sensor import Sensor, SensorSettings

Pose = tuple[float, float, float]
"""x, y (m) and heading (rad) of the body origin in the table frame."""
Picture = NDArray[np.float32]
Rgb = tuple[float, float, float]

FINE = 4
"""Albedo is drawn so many times finer than the pixels."""
_SHIFT = 4  # fractional bits of polygon corners
_SIDES = 64
_MARGIN_PX = 4
_MAX_STEPS = 12
_CELL_PX = 8  # the ground is looked up per cell and interpolated

ALBEDO: Mapping[str, Rgb] = {
    "red": (0.70, 0.07, 0.07),
    "green": (0.10, 0.52, 0.16),
    "blue": (0.07, 0.16, 0.62),
    "table": (0.56, 0.56, 0.54),
    "rim": (0.20, 0.20, 0.21),
    "floor": (0.26, 0.22, 0.18),
    "bumper": (0.30, 0.30, 0.31),
    "plate": (0.11, 0.11, 0.12),
    "hand": (0.66, 0.44, 0.34),
}
_RIM_M = 0.02
_BUMPER_HEIGHT_M = 0.08
_HAND_RADIUS_M = 0.06
_HAND_ABOVE_M = 0.05


@dataclass(frozen=True, slots=True)
class Light:
    """What lights the table, and how bright the picture gets.

    Attributes:
        colour: Relative strength of red, green and blue, as the camera's white balance leaves it.
        unevenness_ratio: Relative size of the lamps' patches.
        level_dn: Grey level of a white surface at the middle of the picture.
    """

    colour: Rgb = (1.06, 1.0, 0.86)
    unevenness_ratio: float = 0.25
    level_dn: float = 270.0


@dataclass(frozen=True, slots=True)
class Body:
    """How a mock-up looks: its discs and the radius of its bumper."""

    markings: Markings
    radius_m: float


class TableView:
    """Draws what the camera over the table sees.

    Args:
        optics: The camera.
        bounds_m: Of the table: x_min, x_max, y_min, y_max.
        bodies: The mock-ups by name.
        light: Lamps.
        seed: Decides lamps, dirt and noise.
    """

    PSF_SIGMA_PX = 0.7

    def __init__(
        self,
        optics: OverheadOptics,
        bounds_m: tuple[float, float, float, float],
        bodies: Mapping[str, Body],
        light: Light,
        seed: np.random.SeedSequence,
    ) -> None:
        self._optics, self._bodies = optics, dict(bodies)
        rows, columns = optics.height_px, optics.width_px
        scenery, noise = seed.spawn(2)
        rng = np.random.default_rng(scenery)
        settings = SensorSettings(read_noise_e=25.0, gain_e_dn=20.0, black_dn=6.0, hot_pixels=12)
        self._sensor = Sensor(settings, rows, columns, noise)
        place_m, cosine = self._seen_ground()
        self._albedo = self._ground(place_m, bounds_m, rng)
        lamps = self._lamps(place_m, bounds_m, light.unevenness_ratio, rng)
        shade = (light.level_dn * lamps * cosine**4)[..., None] * np.asarray(light.colour)
        self._light: Picture = shade.astype(np.float32)
        self._filters = np.zeros((rows, columns, 3), np.float32)
        for channel, top, left in ((0, 0, 0), (1, 0, 1), (1, 1, 0), (2, 1, 1)):
            self._filters[top::2, left::2, channel] = 1.0
        self._empty = self._filtered(self._albedo, slice(0, rows), slice(0, columns))

    def render(
        self, paths: Mapping[str, tuple[Pose, Pose]], sequence: int, hidden: Mapping[str, int] | None = None
    ) -> NDArray[np.uint8]:
        """One picture.

        Args:
            paths: Poses of every mock-up at the beginning and end of the exposure.
            sequence: Number of the frame; decides its noise.
            hidden: How many discs of a mock-up hands cover.

        Returns:
            uint8 (height, width, 3), blue-green-red.
        """
        mosaic = self._empty.copy()
        for names, window in self._groups(paths):
            albedo = self._draw([(name, paths[name], (hidden or {}).get(name, 0)) for name in names], window)
            mosaic[window] = self._filtered(albedo, *window)
        raw = self._sensor.expose(mosaic, sequence)
        # OpenCV names a pattern by its second row: this one begins red, green
        return np.asarray(cv2.cvtColor(raw, cv2.COLOR_BayerBG2BGR), dtype=np.uint8)

    def _seen_ground(self) -> tuple[Floats, Floats]:
        """What each pixel sees of the table's plane (rows, columns, 2), and its ray's cosine off axis."""
        size = (self._optics.width_px, self._optics.height_px)
        cells = (-(-size[0] // _CELL_PX), -(-size[1] // _CELL_PX))
        v, u = np.indices(cells[::-1], dtype=float)
        scale = np.array(
            [size[0] / cells[0], size[1] / cells[1]]
        )  # middles of the cells as cv2.resize has them
        pixels = (np.column_stack([u.ravel(), v.ravel()]) + 0.5) * scale - 0.5
        place_m, cosine = self._optics.on_plane(pixels, 0.0)
        coarse = np.column_stack([place_m, cosine]).reshape(*cells[::-1], 3)
        smooth = np.asarray(cv2.resize(coarse, size, interpolation=cv2.INTER_CUBIC), dtype=np.float64)
        return smooth[..., :2], smooth[..., 2]

    def _filtered(self, albedo: Picture, rows: slice, columns: slice) -> Picture:
        light = albedo * self._light[rows, columns] * self._filters[rows, columns]
        return np.asarray(light.sum(axis=2), dtype=np.float32)

    def _ground(self, place_m: Floats, bounds_m: Sequence[float], rng: np.random.Generator) -> Picture:
        x, y = place_m[..., 0], place_m[..., 1]
        x_min, x_max, y_min, y_max = bounds_m
        inside = np.minimum.reduce([x - x_min, x_max - x, y - y_min, y_max - y])
        ground = np.full((*x.shape, 3), ALBEDO["floor"], np.float32)
        ground[inside > -_RIM_M] = ALBEDO["rim"]
        ground[inside > 0.0] = ALBEDO["table"]
        dirt = cv2.resize(rng.normal(0.0, 0.02, (x.shape[0] // 8, x.shape[1] // 8)), x.shape[::-1])
        ground *= (1.0 + dirt[..., None]).astype(np.float32)
        return np.asarray(cv2.GaussianBlur(ground, (0, 0), self.PSF_SIGMA_PX), dtype=np.float32)

    @staticmethod
    def _lamps(
        place_m: Floats, bounds_m: Sequence[float], unevenness_ratio: float, rng: np.random.Generator
    ) -> Floats:
        x_min, x_max, y_min, y_max = bounds_m
        light = np.ones(place_m.shape[:2])
        for _ in range(3):
            middle = rng.uniform((x_min, y_min), (x_max, y_max))
            sign = rng.choice((-1.0, 1.0))
            reach_m = rng.uniform(0.6, 1.4)
            light += (
                sign * unevenness_ratio * np.exp(-0.5 * ((place_m - middle) ** 2).sum(axis=2) / reach_m**2)
            )
        return np.clip(light, 0.3, None)

    def _groups(self, paths: Mapping[str, tuple[Pose, Pose]]) -> list[tuple[list[str], tuple[slice, slice]]]:
        """Mock-ups whose windows touch are drawn together: (names, (rows, columns))."""
        boxes: list[tuple[list[str], Floats]] = []
        for name in sorted(paths):
            box = self._box(name, paths[name])
            names = [name]
            apart = []
            for other, other_box in boxes:
                if np.all(box[0] < other_box[1]) and np.all(other_box[0] < box[1]):
                    box = np.array([np.minimum(box[0], other_box[0]), np.maximum(box[1], other_box[1])])
                    names = [*other, *names]
                else:
                    apart.append((other, other_box))
            boxes = [*apart, (names, box)]
        out = []
        for names, box in boxes:
            (left, top), (right, bottom) = box.astype(int).tolist()
            if right - left > 2 * _MARGIN_PX and bottom - top > 2 * _MARGIN_PX:
                out.append((names, (slice(top, bottom), slice(left, right))))
        return out

    def _box(self, name: str, path: tuple[Pose, Pose]) -> Floats:
        """Window of a mock-up: ((left, top), (right, bottom)), inside the picture."""
        body = self._bodies[name]
        reach = body.radius_m + _HAND_RADIUS_M
        corners = [
            (x + dx * reach, y + dy * reach, height)
            for x, y, _ in path
            for dx in (-1, 1)
            for dy in (-1, 1)
            for height in (0.0, body.markings.height_m + _HAND_ABOVE_M)
        ]
        pixels = self._optics.project(corners)
        limits = (self._optics.width_px, self._optics.height_px)
        low = np.clip(np.floor(pixels.min(axis=0)) - _MARGIN_PX, 0, limits)
        return np.array([low, np.clip(np.ceil(pixels.max(axis=0)) + _MARGIN_PX, low, limits)])

    def _draw(
        self, movers: Sequence[tuple[str, tuple[Pose, Pose], int]], window: tuple[slice, slice]
    ) -> Picture:
        """Mean albedo of a window over the exposure, as the lens blurs it."""
        ground = self._albedo[window]
        size = (ground.shape[1], ground.shape[0])
        fine = np.repeat(np.repeat(ground, FINE, axis=0), FINE, axis=1)
        steps = max(self._steps(path) for _, path, _ in movers)
        mean = np.zeros_like(ground)
        for step in range(steps):
            share = (step + 0.5) / steps
            canvas = fine.copy()
            for name, (start, end), hidden in movers:
                turn = (end[2] - start[2] + np.pi) % (2.0 * np.pi) - np.pi
                pose = (
                    start[0] + share * (end[0] - start[0]),
                    start[1] + share * (end[1] - start[1]),
                    start[2] + share * turn,
                )
                self._paint(canvas, window, self._bodies[name], pose, hidden)
            mean += cv2.resize(canvas, size, interpolation=cv2.INTER_AREA)
        mean /= np.float32(steps)
        return np.asarray(cv2.GaussianBlur(mean, (0, 0), self.PSF_SIGMA_PX), dtype=np.float32)

    def _steps(self, path: tuple[Pose, Pose]) -> int:
        """Enough pictures along the path that none is half a pixel from the next."""
        (ax, ay, ah), (bx, by, bh) = path
        arc = abs((bh - ah + np.pi) % (2.0 * np.pi) - np.pi) * 0.2
        pixels = (np.hypot(bx - ax, by - ay) + arc) * self._optics.focal_px[0] / self._optics.position_m[2]
        return int(min(_MAX_STEPS, 1 + np.ceil(2.0 * pixels)))

    def _paint(
        self, canvas: Picture, window: tuple[slice, slice], body: Body, pose: Pose, hidden: int
    ) -> None:
        x, y, heading = pose
        cosine, sine = np.cos(heading), np.sin(heading)
        marks = body.markings
        discs = [
            (x + cosine * disc.x_m - sine * disc.y_m, y + sine * disc.x_m + cosine * disc.y_m, disc.colour)
            for disc in marks.discs
        ]
        self._disc(canvas, window, (x, y, _BUMPER_HEIGHT_M), body.radius_m, ALBEDO["bumper"])
        self._disc(canvas, window, (x, y, marks.height_m), 0.96 * body.radius_m, ALBEDO["plate"])
        for disc_x, disc_y, colour in discs:
            self._disc(canvas, window, (disc_x, disc_y, marks.height_m), marks.radius_m, ALBEDO[colour])
        for disc_x, disc_y, _ in discs[:hidden]:
            above = (disc_x + 0.01, disc_y, marks.height_m + _HAND_ABOVE_M)
            self._disc(canvas, window, above, _HAND_RADIUS_M, ALBEDO["hand"])

    def _disc(
        self,
        canvas: Picture,
        window: tuple[slice, slice],
        centre_m: tuple[float, float, float],
        radius_m: float,
        albedo: Rgb,
    ) -> None:
        angle = np.arange(_SIDES) * (2.0 * np.pi / _SIDES)
        # a polygon of the circle's area
        reach = radius_m * np.sqrt(2.0 * np.pi / (_SIDES * np.sin(2.0 * np.pi / _SIDES)))
        rim = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(_SIDES)]) * reach + centre_m
        pixels = self._optics.project(rim) - (window[1].start, window[0].start)
        fine = (pixels + 0.5) * FINE - 0.5
        corners = np.round(fine * (1 << _SHIFT)).astype(np.int32)
        cv2.fillPoly(canvas, [corners], albedo, shift=_SHIFT)
