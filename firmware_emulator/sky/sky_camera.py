"""A webcam that looks up at the sky of LEDs: poses of the exposure in, picture out."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from firmware_emulator.sky.optics import CameraOptics, Floats
from firmware_emulator.sky.sensor import Sensor, SensorSettings
from firmware_emulator.sky.sky import Sky, SkyFailures
from firmware_emulator.sky.spots import add_spots, steps_of

Pose = tuple[float, float, float]
"""x, y (m) and heading (rad) of the body origin in the table frame."""

_FALLOFF_POWER = 4  # natural vignetting, cos^4 of the angle off axis
_GLOW_CELL_PX = 16  # diffuse light is smooth: computed per cell, interpolated between
_SHUTTER_STEPS = 4  # of the fixed point below; each shrinks the error by rows/s * readout / rows, < 0.1
_MARGIN_PX = 8.0  # a spot whose middle lies outside still sheds light inside


@dataclass(frozen=True, slots=True)
class Shutter:
    """How the rows are exposed.

    Attributes:
        exposure_s: How long each row is exposed.
        readout_s: From the first row's exposure to the last row's; 0 is a global shutter.
    """

    exposure_s: float
    readout_s: float = 0.0

    def __post_init__(self) -> None:
        if not (self.exposure_s > 0.0 and self.readout_s >= 0.0):
            raise ValueError("exposure_s must be positive and readout_s not negative")


class SkyCamera:
    """Draws what one mock-up's camera sees.

    A frame depends on the arguments, the state of the sky and the frame's number, not on frames before it.

    Args:
        optics: The lens and how it is mounted.
        sky: What hangs above; shared with other cameras, may change between frames.
        shutter: Exposure and readout.
        settings: Figures of the chip.
        seed: Of this camera's noise and hot pixels.
    """

    def __init__(
        self,
        optics: CameraOptics,
        sky: Sky,
        shutter: Shutter,
        settings: SensorSettings,
        seed: np.random.SeedSequence,
    ) -> None:
        self.optics, self.sky, self.shutter = optics, sky, shutter
        self.sensor = Sensor(settings, optics.height_px, optics.width_px, seed)
        self._footprint_m2 = optics.footprint_m2()
        self._cells = (-(-optics.height_px // _GLOW_CELL_PX), -(-optics.width_px // _GLOW_CELL_PX))
        v, u = np.indices(self._cells, dtype=float)
        # Middles of the cells as cv2.resize places them.
        scale = np.array([optics.width_px / self._cells[1], optics.height_px / self._cells[0]])
        pixels = (np.column_stack([u.ravel(), v.ravel()]) + 0.5) * scale - 0.5
        self._cells_body_m, cosine = optics.ceiling_in_body(pixels)
        self._cells_falloff = cosine**_FALLOFF_POWER

    def render(
        self,
        start: Pose,
        end: Pose,
        *,
        sequence: int,
        is_sky_dead: bool = False,
        false_lights: float = 0.0,
        sky_failures: SkyFailures | None = None,
    ) -> NDArray[np.uint8]:
        """One picture.

        Args:
            start: Pose when the shutter opened (of the first row, with a rolling shutter).
            end: Pose when it closed (of the last row); between them velocity and turn rate are constant, and
                the turn is less than half a turn.
            sequence: Number of the frame; decides its noise.
            is_sky_dead: The LEDs are switched off.
            false_lights: How many stray lights a view of this size holds on average.
            sky_failures: LEDs that differ from the list.

        Returns:
            uint8 (height, width). The pose it belongs to is that of half the time from `start` to `end`.

        Raises:
            ValueError: A pose that is not finite.
        """
        path = np.array([start, end], dtype=float)
        if path.shape != (2, 3) or not np.all(np.isfinite(path)):
            raise ValueError(f"a pose is three finite numbers, x, y and heading; got {start} and {end}")
        path[1, 2] = path[0, 2] + np.remainder(path[1, 2] - path[0, 2] + np.pi, 2.0 * np.pi) - np.pi
        light_dn = self._diffuse(path.mean(axis=0))
        xy_m, brightness = self.sky.lights(
            false_lights / self._footprint_m2, is_dark=is_sky_dead, failures=sky_failures
        )
        self._add_lights(light_dn, path, xy_m, brightness)
        return self.sensor.expose(light_dn, sequence)

    def _diffuse(self, middle: Floats) -> NDArray[np.float32]:
        x, y, heading = middle
        c, s = np.cos(heading), np.sin(heading)
        on_ceiling = self._cells_body_m @ np.array([[c, s], [-s, c]]) + (x, y)
        cells = self.sensor.settings.ambient_dn * self._cells_falloff * self.sky.diffuse_light(on_ceiling)
        size = (self.optics.width_px, self.optics.height_px)
        return cv2.resize(cells.reshape(self._cells).astype(np.float32), size).astype(np.float32, copy=False)

    def _add_lights(
        self, light_dn: NDArray[np.float32], path: Floats, xy_m: Floats, brightness: Floats
    ) -> None:
        seen = self._may_appear(path, xy_m)
        xy_m, brightness = xy_m[seen], brightness[seen]
        if len(xy_m) == 0:
            return
        opens, closes = self._windows(path, xy_m)
        ends, _ = self._at(path, xy_m[:, None], np.column_stack([opens, closes]))
        streak_px = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        sigma_px = self.sensor.settings.psf_sigma_px
        steps = steps_of(float(np.nanmax(streak_px, initial=0.0)), sigma_px)
        share = (np.arange(steps) + 0.5) / steps
        times = opens[:, None] + (closes - opens)[:, None] * share
        pixels, cosine = self._at(path, xy_m[:, None], times)
        span_s = self.shutter.exposure_s + self.shutter.readout_s
        open_ratio = (closes - opens) * span_s / self.shutter.exposure_s
        falloff = np.mean(cosine, axis=1) ** _FALLOFF_POWER
        flux = self.sensor.settings.led_flux_dn * brightness * falloff * open_ratio
        whole = np.all(np.isfinite(pixels), axis=(1, 2))
        add_spots(light_dn, pixels[whole], flux[whole], sigma_px)

    def _may_appear(self, path: Floats, xy_m: Floats) -> NDArray[np.bool_]:
        """Which points come near the picture at the beginning, middle or end."""
        pixels, _ = self._at(path, xy_m[:, None], np.array([0.0, 0.5, 1.0]))
        low, high = pixels.min(axis=1) - _MARGIN_PX, pixels.max(axis=1) + _MARGIN_PX
        size = (self.optics.width_px - 1, self.optics.height_px - 1)
        return np.asarray(np.all((high >= 0.0) & (low <= size), axis=1))  # NaN compares false

    def _windows(self, path: Floats, xy_m: Floats) -> tuple[Floats, Floats]:
        """When each point's row is exposed: fractions of the time from start to end, each (n,).

        With a rolling shutter the row depends on the moment and the moment on the row; a light that runs with
        the shutter is exposed for longer.
        """
        span_s = self.shutter.exposure_s + self.shutter.readout_s
        exposed = self.shutter.exposure_s / span_s
        rolled = self.shutter.readout_s / span_s
        opens, closes = np.zeros(len(xy_m)), np.ones(len(xy_m))
        if rolled == 0.0:
            return opens, closes
        last_row = self.optics.height_px - 1.0
        for _ in range(_SHUTTER_STEPS):
            pixels, _ = self._at(path, xy_m[:, None], np.column_stack([opens, closes]))
            delay = rolled * np.clip(np.nan_to_num(pixels[..., 1]) / last_row, 0.0, 1.0)
            opens, closes = delay[:, 0], delay[:, 1] + exposed
        return opens, closes

    def _at(self, path: Floats, xy_m: Floats, times: Floats) -> tuple[Floats, Floats]:
        """Pixels and cosines of points at fractions of the time from start to end, broadcast."""
        pose = path[0] + np.asarray(times)[..., None] * (path[1] - path[0])
        return self.optics.project(xy_m, (pose[..., 0], pose[..., 1], pose[..., 2]))
