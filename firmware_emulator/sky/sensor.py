"""The camera's chip: photons to grey levels, with read and shot noise, hot pixels, saturation.

Noise per pixel is Gaussian of variance `read^2 + light / gain`; beside a read noise of 25 electrons the
Poisson law of the photons cannot be told from that. The random numbers come from a tile drawn once per
camera; each frame takes a window of it at a random place and flip, so that a frame costs three random numbers
instead of 300,000.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.float32]

_TILE_MARGIN_PX = 256  # 65,536 places x 4 flips before a frame's noise repeats
_HOT_LEVELS_DN = (30.0, 200.0)


@dataclass(frozen=True, slots=True)
class SensorSettings:
    """Figures of an 8-bit webcam chip at the operator's gain.

    Defaults were fitted to the sample frames of the star tracker: noise 1.4 grey levels in the dark and 1.9
    at level 40, spots of 1.2 px standard deviation, 25 hot pixels.

    Attributes:
        psf_sigma_px: Standard deviation of the lens's point spread.
        read_noise_e: Standard deviation of the read noise, electrons.
        gain_e_dn: Electrons per grey level (DN).
        black_dn: Grey level of no light.
        led_flux_dn: Whole light of an LED of brightness 1 on the optical axis, over the exposure. Operators
            set gain and LED current for it, whatever the exposure.
        ambient_dn: Diffuse light of a normal ceiling on the optical axis, over the exposure.
        hot_pixels: How many pixels shine by themselves.

    Raises:
        ValueError: A figure that is negative or, for spread and gain, not positive.
    """

    psf_sigma_px: float = 1.2
    read_noise_e: float = 25.0
    gain_e_dn: float = 20.0
    black_dn: float = 5.0
    led_flux_dn: float = 1600.0
    ambient_dn: float = 4.0
    hot_pixels: int = 25

    def __post_init__(self) -> None:
        if not (self.psf_sigma_px > 0.0 and self.gain_e_dn > 0.0):
            raise ValueError("psf_sigma_px and gain_e_dn must be positive")
        levels = (self.read_noise_e, self.black_dn, self.led_flux_dn, self.ambient_dn, self.hot_pixels)
        if not min(levels) >= 0.0:
            raise ValueError("noise, levels and hot pixels must not be negative")


class Sensor:
    """A chip with its own noise tile and hot pixels.

    Args:
        settings: Its figures.
        rows: Of the picture.
        columns: Of the picture.
        seed: Decides tile, hot pixels and every frame's noise.
    """

    def __init__(
        self, settings: SensorSettings, rows: int, columns: int, seed: np.random.SeedSequence
    ) -> None:
        self.settings = settings
        self._seed_words = tuple(int(word) for word in seed.generate_state(4))
        rng = np.random.default_rng(self._seed_words)
        self._tile = rng.standard_normal(
            (rows + _TILE_MARGIN_PX, columns + _TILE_MARGIN_PX), dtype=np.float32
        )
        self._shape = (rows, columns)
        self._noise = np.empty(self._shape, dtype=np.float32)
        self._hot_rows = rng.integers(0, rows, settings.hot_pixels)
        self._hot_columns = rng.integers(0, columns, settings.hot_pixels)
        self._hot_dn = rng.uniform(*_HOT_LEVELS_DN, settings.hot_pixels).astype(np.float32)

    @property
    def hot_pixels(self) -> tuple[NDArray[np.intp], NDArray[np.intp], Picture]:
        """Rows, columns and grey levels above their surroundings of the hot pixels, each (n,)."""
        return self._hot_rows, self._hot_columns, self._hot_dn

    @hot_pixels.setter
    def hot_pixels(self, pixels: tuple[NDArray[np.intp], NDArray[np.intp], Picture]) -> None:
        rows, columns, level_dn = pixels
        inside = (rows >= 0) & (rows < self._shape[0]) & (columns >= 0) & (columns < self._shape[1])
        if not (rows.shape == columns.shape == level_dn.shape and bool(np.all(inside))):
            raise ValueError("hot pixels need rows, columns and levels of equal length, inside the picture")
        self._hot_rows, self._hot_columns = rows.astype(np.intp), columns.astype(np.intp)
        self._hot_dn = level_dn.astype(np.float32)

    def expose(self, light_dn: Picture, sequence: int) -> NDArray[np.uint8]:
        """Grey levels of a picture of light.

        Args:
            light_dn: Light per pixel (rows, columns), grey levels above black; is overwritten.
            sequence: Number of the frame, which decides its noise: one frame is the same in any order.

        Returns:
            uint8 (rows, columns).
        """
        settings = self.settings
        np.add.at(light_dn, (self._hot_rows, self._hot_columns), self._hot_dn)
        read_dn = settings.read_noise_e / settings.gain_e_dn
        np.multiply(light_dn, np.float32(1.0 / settings.gain_e_dn), out=self._noise)
        self._noise += np.float32(read_dn**2)
        cv2.sqrt(self._noise, self._noise)
        self._noise *= self._window(sequence)
        self._noise += np.float32(settings.black_dn)
        # One pass that adds, rounds and saturates.
        return np.asarray(cv2.add(light_dn, self._noise, dtype=cv2.CV_8U), dtype=np.uint8)

    def _window(self, sequence: int) -> Picture:
        rng = np.random.default_rng((*self._seed_words, sequence))
        top, left, flip = rng.integers(0, (_TILE_MARGIN_PX + 1, _TILE_MARGIN_PX + 1, 4)).tolist()
        window = self._tile[top : top + self._shape[0], left : left + self._shape[1]]
        return window[:: -1 if flip & 1 else 1, :: -1 if flip & 2 else 1]
