"""The ceiling and its lights: LEDs that may die, lights that no catalogue knows, lamps' soft glow.

One sky hangs over all mock-ups of a laboratory; their cameras share this object, which failures change.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

_MARGIN_M = 0.3  # stray lights also shine a little beyond the outermost LEDs
_STRAY_RESERVE = 4096
_STRAY_SPREAD = 0.5  # of the logarithm of a stray light's brightness


@dataclass(frozen=True, slots=True)
class Glow:
    """A soft bright patch on the ceiling: a lamp's reflection, a window.

    Attributes:
        x_m: Its middle on the ceiling.
        y_m: Its middle on the ceiling.
        radius_m: Standard deviation of its Gaussian shape.
        brightness: In its middle, relative to the ambient light of the ceiling.
    """

    x_m: float
    y_m: float
    radius_m: float
    brightness: float


@dataclass(frozen=True, slots=True)
class SkyFailures:
    """What differs from the list of LEDs in one picture.

    Attributes:
        dead: LEDs that are dark.
        moved: LEDs with what is added to their places, m.
        new: Places of lights that no list knows, as bright as a nominal LED.
    """

    dead: tuple[int, ...] = ()
    moved: tuple[tuple[int, float, float], ...] = ()
    new: tuple[tuple[float, float], ...] = ()


class Sky:
    """All that shines on the ceiling.

    Args:
        ceiling_xy_m: LEDs, shape (n, 2), ceiling coordinates (table x, y carried straight up).
        brightness: Of each LED, shape (n,), relative to the nominal one.
        rng: Draws where stray lights would be; nothing else.
        glows: Soft patches.

    Attributes:
        is_dead: bool (n,), which LEDs are dark. Failures write here.
        ambient: Diffuse light of the ceiling, relative to normal; 0 is a dark room.

    Raises:
        ValueError: Shapes that do not match, values that are not finite, or a negative brightness.
    """

    def __init__(
        self,
        ceiling_xy_m: ArrayLike,
        brightness: ArrayLike,
        rng: np.random.Generator,
        glows: Iterable[Glow] = (),
    ) -> None:
        self.leds_xy_m = np.array(ceiling_xy_m, dtype=float)
        self.brightness = np.array(brightness, dtype=float)
        count = len(self.leds_xy_m)
        if self.leds_xy_m.shape != (count, 2) or self.brightness.shape != (count,) or count == 0:
            raise ValueError(
                f"a sky needs LEDs (n, 2) and brightness (n,), "
                f"got {self.leds_xy_m.shape} and {self.brightness.shape}"
            )
        if not (np.all(np.isfinite(self.leds_xy_m)) and np.all(np.isfinite(self.brightness))):
            raise ValueError("places and brightness of LEDs must be finite")
        if np.any(self.brightness < 0.0):
            raise ValueError("no LED is darker than dark: brightness must not be negative")
        self.is_dead = np.zeros(count, dtype=bool)
        self.ambient = 1.0
        self.glows = tuple(glows)
        self._false_xy_m: Floats = np.empty((0, 2))
        self._false_brightness: Floats = np.empty(0)
        low = self.leds_xy_m.min(axis=0) - _MARGIN_M
        high = self.leds_xy_m.max(axis=0) + _MARGIN_M
        self._area_m2 = float(np.prod(high - low))
        self._stray_xy_m = rng.uniform(low, high, (_STRAY_RESERVE, 2))
        self._stray_brightness = np.exp(_STRAY_SPREAD * rng.standard_normal(_STRAY_RESERVE))

    def kill(self, leds: ArrayLike) -> None:
        """Put out the LEDs of these indices."""
        self.is_dead[np.asarray(leds, dtype=np.intp)] = True

    def revive(self) -> None:
        """Every LED shines again."""
        self.is_dead[:] = False

    def add_false_lights(self, ceiling_xy_m: ArrayLike, brightness: ArrayLike) -> None:
        """Add lights, shapes (m, 2) and (m,), that no catalogue knows; they stay until cleared."""
        xy_m = np.asarray(ceiling_xy_m, dtype=float).reshape(-1, 2)
        self._false_xy_m = np.concatenate([self._false_xy_m, xy_m])
        self._false_brightness = np.concatenate(
            [self._false_brightness, np.broadcast_to(np.asarray(brightness, dtype=float), len(xy_m))]
        )

    def clear_false_lights(self) -> None:
        """Remove all false lights."""
        self._false_xy_m, self._false_brightness = np.empty((0, 2)), np.empty(0)

    def lights(
        self, stray_per_m2: float = 0.0, *, is_dark: bool = False, failures: SkyFailures | None = None
    ) -> tuple[Floats, Floats]:
        """All that shines as points.

        Args:
            stray_per_m2: Add stray lights of this density. They hang at fixed places, drawn once, and a
                higher density keeps those of a lower one.
            is_dark: The LEDs are switched off; false and stray lights are not.
            failures: LEDs that differ from the list; numbers that no LED has are nobody's.

        Returns:
            Places (m, 2) and relative brightness (m,).
        """
        shines = np.zeros_like(self.is_dead) if is_dark else ~self.is_dead
        stray = min(_STRAY_RESERVE, round(stray_per_m2 * self._area_m2))
        leds_xy_m, new_xy_m = self.leds_xy_m, np.empty((0, 2))
        if failures is not None:
            shines[[led for led in failures.dead if led < len(shines)]] = False
            leds_xy_m, new_xy_m = leds_xy_m.copy(), np.array(failures.new, dtype=float).reshape(-1, 2)
            for led, dx_m, dy_m in failures.moved:
                leds_xy_m[led : led + 1] += (dx_m, dy_m)
        places = (leds_xy_m[shines], self._false_xy_m, new_xy_m, self._stray_xy_m[:stray])
        brightness = (
            self.brightness[shines],
            self._false_brightness,
            np.ones(len(new_xy_m)),
            self._stray_brightness[:stray],
        )
        return np.concatenate(places), np.concatenate(brightness)

    def diffuse_light(self, ceiling_xy_m: Floats) -> Floats:
        """Diffuse light of points (n, 2) of the ceiling, shape (n,), 1 where it is the normal ambient."""
        light = np.ones(len(ceiling_xy_m))
        for glow in self.glows:
            distance_m2 = np.sum((ceiling_xy_m - (glow.x_m, glow.y_m)) ** 2, axis=1)
            light += glow.brightness * np.exp(-0.5 * distance_m2 / glow.radius_m**2)
        return self.ambient * light
