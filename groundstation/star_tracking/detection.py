"""Light spots of a picture: threshold by noise, label, judge, centre.

A spot is a group of neighbouring pixels whose smoothed level stands out of the noise. Hot pixels
(one pixel holds nearly all of the light) and spots cut by the edge of the picture are dropped and
counted; the centres of the others are fitted. All of it is one call of the core (``core/detect.c``).
"""

import mmap
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.core.library import default_core
from groundstation.star_tracking.picture_seams import PictureSeams


class PictureError(ValueError):
    """A picture that no detector can work on: not grey, not 8 bit, or of the wrong size."""


@dataclass(frozen=True, slots=True)
class DetectorSettings:
    """What counts as a spot.

    Attributes:
        threshold_sigmas: How far the smoothed level stands out of the noise.
        hot_pixel_ratio: A brightest pixel that holds more of the spot's light is a hot pixel.
        saturation_dn: Pixels from here on are not measured, only known to be bright.
        gain_dn_per_electron: Shot noise of the stars: variance in DN^2 per DN of light.
        max_spots: The brightest so many are kept.
        max_lit_ratio: With more of the picture above threshold it is flooded, not starred.

    Raises:
        ValueError: A limit is not one.
    """

    threshold_sigmas: float = 5.0
    hot_pixel_ratio: float = 0.45
    saturation_dn: int = 250
    gain_dn_per_electron: float = 0.04
    max_spots: int = 120
    max_lit_ratio: float = 0.15

    def __post_init__(self) -> None:
        if self.max_spots < 0 or not 0.0 <= self.max_lit_ratio <= 1.0:
            raise ValueError(
                "a detector needs max_spots of 0 or more and max_lit_ratio between 0 and 1, found "
                f"{self.max_spots} and {self.max_lit_ratio}"
            )


@dataclass(frozen=True, slots=True, eq=False)
class Spots:
    """Light spots, brightest first.

    Attributes:
        u_px: Centres, shape (n,).
        v_px: Centres, shape (n,).
        flux_dn: Light above the background, shape (n,).
        covariance_px2: Covariance of the centres: uu, uv, vv, shape (n, 3).
        elongation: Long over short axis, 1 for round, shape (n,).
        streak_px: Motion streak (du, dv) fitted to the picture, its sign unknown, shape (n, 2).
        background_dn: Median background of the picture.
        noise_dn: One sigma of a pixel there.
        hot_pixels: How many groups were dropped as hot pixels.
        cut_by_edge: How many were dropped at the edge.
        is_flooded: More light than a sky of stars can have: nothing was measured.
        seam: Where the picture is put together from parts; empty if it is whole.
    """

    u_px: NDArray[np.float64]
    v_px: NDArray[np.float64]
    flux_dn: NDArray[np.float64]
    covariance_px2: NDArray[np.float64]
    elongation: NDArray[np.float64]
    streak_px: NDArray[np.float64]
    background_dn: float
    noise_dn: float
    hot_pixels: int = 0
    cut_by_edge: int = 0
    is_flooded: bool = False
    seam: str = ""

    def __len__(self) -> int:
        return len(self.u_px)


class Detector:
    """Finds the light spots of grey pictures; keeps its memory between pictures, one thread at a time.

    Args:
        settings: What counts as a spot.

    Raises:
        CoreError: There is no compiled core.
    """

    def __init__(self, settings: DetectorSettings | None = None) -> None:
        settings = settings or DetectorSettings()
        core = default_core()
        self._ffi, self._lib = core.ffi, core.lib
        self._max_lit_ratio = settings.max_lit_ratio
        self._settings = self._ffi.new("DetectorSettings *")
        for name, _ in self._ffi.typeof("DetectorSettings").fields:
            if name != "max_lit":  # depends on the size of the picture
                setattr(self._settings, name, getattr(settings, name))
        fitted = self._ffi.new("FittedSpot[]", max(settings.max_spots, 1))
        self._fitted = np.frombuffer(self._ffi.buffer(fitted)).reshape(len(fitted), -1)
        self._results = (fitted, self._ffi.new("DetectionSummary *"))
        self._seams = PictureSeams()
        self._shape = (0, 0)

    def find(self, image: NDArray[np.uint8]) -> Spots:
        """Find the light spots of a grey picture.

        Args:
            image: Picture (h, w), uint8.

        Raises:
            PictureError: The array is not a grey 8-bit picture of at least 32 x 32 pixels.
        """
        _check(image)
        if image.strides[1] != 1:
            image = np.ascontiguousarray(image)
        if image.shape != self._shape:
            self._make_room(*image.shape)
        # by address: rows may lie apart, which no view of bytes allows
        pixels = self._ffi.cast("uint8_t *", image.ctypes.data)
        count = self._lib.gs_detect(
            pixels, image.strides[0], *image.shape, self._settings, self._scratch, *self._results
        )
        fitted, summary = self._fitted[:count], self._results[1]
        u, v, flux, *_, elongation, _, _ = fitted.T.copy()
        return Spots(
            *(u, v, flux, fitted[:, 3:6].copy(), elongation, fitted[:, 7:9].copy()),
            summary.background_dn,
            summary.noise_dn,
            summary.hot_pixels,
            summary.cut_by_edge,
            bool(summary.is_flooded),
            self._seams.find(image),
        )

    def _make_room(self, rows: int, columns: int) -> None:
        self._settings.max_lit = int(self._max_lit_ratio * rows * columns)
        needed = self._lib.gs_detect_scratch_bytes(rows, columns, self._settings)
        # Little of it is ever touched, but NumPy would ask for huge pages, and each touch takes a whole one.
        room = mmap.mmap(-1, needed, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
        self._scratch = self._ffi.from_buffer("uint8_t[]", room)
        self._shape = (rows, columns)


def detect(image: NDArray[np.uint8], settings: DetectorSettings | None = None) -> Spots:
    """Find the light spots of one picture; for many, keep a ``Detector``.

    Args:
        image: Picture (h, w), uint8.
        settings: What counts as a spot.

    Raises:
        PictureError: The array is not a grey 8-bit picture of at least 32 x 32 pixels.
    """
    return Detector(settings).find(image)


def _check(image: NDArray[np.uint8]) -> None:
    if image.ndim != 2:
        raise PictureError(f"expected a grey picture of two dimensions, found {image.ndim} (colour?)")
    if image.dtype != np.uint8:
        raise PictureError(f"expected 8-bit pixels, found {image.dtype}")
    if min(image.shape) < 32:
        raise PictureError(f"expected at least 32 x 32 pixels, found {image.shape[1]} x {image.shape[0]}")
