"""Light spots of a picture: threshold by noise, label, judge, centre.

A spot is a group of neighbouring pixels whose smoothed level stands out of the noise. Hot pixels
(one pixel holds nearly all of the light) and spots cut by the edge of the picture are dropped and
counted. Centres come from ``spot_fit``. All of it exists twice: in the compiled core, and in NumPy.
"""

from dataclasses import asdict, dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.core.library import Core, default_core
from groundstation.star_tracking.background import WEIGHT_SUM, Levels, measure_levels
from groundstation.star_tracking.detection_core import CoreDetector
from groundstation.star_tracking.spot_fit import SpotPixels, fit_spots


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
        cov_px2: Covariance of the centres: uu, uv, vv, shape (n, 3).
        elongation: Long over short axis, 1 for round, shape (n,).
        streak_px: Motion streak (du, dv) fitted to the picture, its sign unknown, shape (n, 2).
        background_dn: Median background of the picture.
        noise_dn: One sigma of a pixel there.
        hot_pixels: How many groups were dropped as hot pixels.
        cut_by_edge: How many were dropped at the edge.
        is_flooded: More light than a sky of stars can have: nothing was measured.
    """

    u_px: NDArray[np.float64]
    v_px: NDArray[np.float64]
    flux_dn: NDArray[np.float64]
    cov_px2: NDArray[np.float64]
    elongation: NDArray[np.float64]
    streak_px: NDArray[np.float64]
    background_dn: float
    noise_dn: float
    hot_pixels: int = 0
    cut_by_edge: int = 0
    is_flooded: bool = False

    def __len__(self) -> int:
        return len(self.u_px)


_GROW = np.ones((3, 3), np.uint8)
_MAX_GROUPS = 20_000  # with more of them the picture is flooded


class Detector:
    """Finds the light spots of grey pictures; keeps its memory between pictures, one thread at a time.

    Args:
        settings: What counts as a spot.
        core: Compiled core or ``PURE``; the default is the compiled one where there is one. Both give
            the same spots, their figures within rounding.
    """

    def __init__(self, settings: DetectorSettings | None = None, core: Core | None = None) -> None:
        self._settings = settings or DetectorSettings()
        core = core or default_core()
        self._compiled = CoreDetector(core, **asdict(self._settings)) if core.is_compiled else None

    def find(self, image: NDArray[np.uint8]) -> Spots:
        """Find the light spots of a grey picture.

        Args:
            image: Picture (h, w), uint8.

        Raises:
            PictureError: The array is not a grey 8-bit picture of at least 32 x 32 pixels.
        """
        _check(image)
        if self._compiled is None:
            return _find(image, self._settings)
        fitted, summary = self._compiled.find(image)
        u, v, flux, *_, elongation, _, _ = fitted.T.copy()
        return Spots(
            *(u, v, flux, fitted[:, 3:6].copy(), elongation, fitted[:, 7:9].copy()),
            summary.background_dn,
            summary.noise_dn,
            summary.hot_pixels,
            summary.cut_by_edge,
            bool(summary.is_flooded),
        )


def detect(image: NDArray[np.uint8], settings: DetectorSettings | None = None) -> Spots:
    """Find the light spots of one picture; for many, keep a ``Detector``.

    Args:
        image: Picture (h, w), uint8.
        settings: What counts as a spot.

    Raises:
        PictureError: The array is not a grey 8-bit picture of at least 32 x 32 pixels.
    """
    return Detector(settings).find(image)


def _find(image: NDArray[np.uint8], settings: DetectorSettings) -> Spots:
    levels = measure_levels(image)
    mask = cv2.compare(levels.smooth, levels.threshold(settings.threshold_sigmas), cv2.CMP_GT)
    lit = cv2.countNonZero(mask)
    if lit == 0:
        return _nothing(levels)
    if lit > int(settings.max_lit_ratio * mask.size):
        return _nothing(levels, is_flooded=True)
    # This algorithm numbers groups by their first pixel in reading order, as the core does.
    count, labels = cv2.connectedComponentsWithAlgorithm(mask, 8, cv2.CV_32S, cv2.CCL_SAUF)
    if count - 1 > _MAX_GROUPS:
        return _nothing(levels, is_flooded=True)
    grown = np.asarray(cv2.dilate(np.asarray(labels, dtype=np.uint16), _GROW), dtype=np.uint16)
    pixels = _gather(image, levels, grown, count - 1, settings)
    spots_kept, hot, cut = _judge(pixels, image.shape, settings)
    if not spots_kept.any():
        return _nothing(levels, hot=hot, cut=cut)
    fitted = fit_spots(pixels.keep(spots_kept))
    order = np.argsort(-fitted.flux_dn, kind="stable")
    return Spots(
        u_px=fitted.u_px[order],
        v_px=fitted.v_px[order],
        flux_dn=fitted.flux_dn[order],
        cov_px2=fitted.cov_px2[order],
        elongation=fitted.elongation[order],
        streak_px=fitted.streak_px[order],
        background_dn=levels.background_dn,
        noise_dn=levels.noise_dn,
        hot_pixels=hot,
        cut_by_edge=cut,
    )


def _check(image: NDArray[np.uint8]) -> None:
    if image.ndim != 2:
        raise PictureError(f"expected a grey picture of two dimensions, found {image.ndim} (colour?)")
    if image.dtype != np.uint8:
        raise PictureError(f"expected 8-bit pixels, found {image.dtype}")
    if min(image.shape) < 32:
        raise PictureError(f"expected at least 32 x 32 pixels, found {image.shape[1]} x {image.shape[0]}")


def _nothing(levels: Levels, hot: int = 0, cut: int = 0, is_flooded: bool = False) -> Spots:
    none = np.zeros(0)
    return Spots(
        none,
        none,
        none,
        np.zeros((0, 3)),
        none,
        np.zeros((0, 2)),
        levels.background_dn,
        levels.noise_dn,
        hot,
        cut,
        is_flooded,
    )


def _gather(
    image: NDArray[np.uint8],
    levels: Levels,
    labels: NDArray[np.uint16],
    count: int,
    settings: DetectorSettings,
) -> SpotPixels:
    """Collect the pixels of every label, sorted by label."""
    where = np.flatnonzero(labels.ravel() != 0)
    label = labels.ravel()[where]
    order = np.argsort(label, kind="stable")  # radix sort: linear for 16-bit keys
    where = where[order]
    raw = image.ravel()[where].astype(np.int64)
    background = levels.background.ravel()[where].astype(np.int64)
    row = where // image.shape[1]
    return SpotPixels(
        u_px=(where - row * image.shape[1]).astype(np.float64),
        v_px=row.astype(np.float64),
        light_dn=(WEIGHT_SUM * raw - background) / WEIGHT_SUM,
        variance_dn2=levels.variance_floor_dn2 + levels.variance_slope_dn * (background / WEIGHT_SUM),
        is_saturated=raw >= settings.saturation_dn,
        size=np.bincount(label, minlength=count + 1)[1:],
        gain_dn_per_electron=settings.gain_dn_per_electron,
    )


def _judge(
    pixels: SpotPixels, shape: tuple[int, ...], settings: DetectorSettings
) -> tuple[NDArray[np.bool_], int, int]:
    """Say which groups are spots, the brightest so many; count hot pixels and those cut by the edge."""
    starts = pixels.starts
    light = np.rint(WEIGHT_SUM * pixels.light_dn)  # whole numbers: sums and comparisons are exact
    total = np.add.reduceat(light, starts)
    hot = np.maximum.reduceat(light, starts) > settings.hot_pixel_ratio * total
    cut = np.minimum.reduceat(pixels.u_px, starts) <= 0
    cut |= np.maximum.reduceat(pixels.u_px, starts) >= shape[1] - 1
    cut |= np.minimum.reduceat(pixels.v_px, starts) <= 0
    cut |= np.maximum.reduceat(pixels.v_px, starts) >= shape[0] - 1
    kept = ~hot & ~cut & (total > 0.0)
    brightest = np.argsort(np.where(kept, -total, np.inf), kind="stable")
    kept[brightest[settings.max_spots :]] = False
    return kept, int(hot.sum()), int((cut & ~hot).sum())
