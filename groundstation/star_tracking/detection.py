"""Light spots of a picture: threshold by noise, label, judge, centre.

A spot is a group of neighbouring pixels whose smoothed level stands out of the noise. Hot pixels
(one pixel holds nearly all of the light) and spots cut by the edge of the picture are dropped and
counted. Centres come from ``spot_fit``.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.star_tracking.background import WEIGHT_SUM, Levels, measure_levels
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
    """

    threshold_sigmas: float = 5.0
    hot_pixel_ratio: float = 0.45
    saturation_dn: int = 250
    gain_dn_per_electron: float = 0.04
    max_spots: int = 120
    max_lit_ratio: float = 0.15


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


def detect(image: NDArray[np.uint8], settings: DetectorSettings | None = None) -> Spots:
    """Find the light spots of a grey picture.

    Args:
        image: Picture (h, w), uint8.
        settings: What counts as a spot.

    Raises:
        PictureError: The array is not a grey 8-bit picture of at least 32 x 32 pixels.
    """
    settings = settings or DetectorSettings()
    _check(image)
    levels = measure_levels(image)
    mask = cv2.compare(levels.smooth, levels.threshold(settings.threshold_sigmas), cv2.CMP_GT)
    lit = cv2.countNonZero(mask)
    if lit == 0:
        return _nothing(levels)
    if lit > settings.max_lit_ratio * mask.size:
        return _nothing(levels, is_flooded=True)
    count, labels = cv2.connectedComponentsWithAlgorithm(mask, 8, cv2.CV_16U, cv2.CCL_BBDT)
    grown = cv2.dilate(np.asarray(labels), _GROW)
    pixels = _gather(image, levels, np.asarray(grown), count - 1, settings)
    spots_kept, hot, cut = _judge(pixels, image.shape, settings)
    if not spots_kept.any():
        return _nothing(levels, hot=hot, cut=cut)
    fitted = fit_spots(pixels.keep(_brightest(pixels, spots_kept, settings.max_spots)))
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
    where = np.flatnonzero((labels != 0).ravel())
    label = labels.ravel()[where]
    order = np.argsort(label, kind="stable")  # radix sort: linear for 16-bit keys
    where = where[order]
    size = np.bincount(label, minlength=count + 1)[1:]
    raw = image.ravel()[where]
    background = levels.background.ravel()[where].astype(np.float64) * (1.0 / WEIGHT_SUM)
    row = where // image.shape[1]
    return SpotPixels(
        u_px=(where - row * image.shape[1]).astype(np.float64),
        v_px=row.astype(np.float64),
        light_dn=raw - background,
        variance_dn2=np.asarray(
            levels.variance_floor_dn2 + levels.variance_slope_dn * background, np.float64
        ),
        is_saturated=raw >= settings.saturation_dn,
        size=size[size > 0],
        gain_dn_per_electron=settings.gain_dn_per_electron,
    )


def _judge(
    pixels: SpotPixels, shape: tuple[int, ...], settings: DetectorSettings
) -> tuple[NDArray[np.bool_], int, int]:
    """Say which groups are spots; count hot pixels and those cut by the edge."""
    starts = pixels.starts
    total = np.add.reduceat(pixels.light_dn, starts)
    peak = np.maximum.reduceat(pixels.light_dn, starts)
    hot = peak > settings.hot_pixel_ratio * total
    cut = np.minimum.reduceat(pixels.u_px, starts) <= 0
    cut |= np.maximum.reduceat(pixels.u_px, starts) >= shape[1] - 1
    cut |= np.minimum.reduceat(pixels.v_px, starts) <= 0
    cut |= np.maximum.reduceat(pixels.v_px, starts) >= shape[0] - 1
    return ~hot & ~cut & (total > 0.0), int(hot.sum()), int((cut & ~hot).sum())


def _brightest(pixels: SpotPixels, kept: NDArray[np.bool_], count: int) -> NDArray[np.bool_]:
    if int(kept.sum()) <= count:
        return kept
    total = np.where(kept, np.add.reduceat(pixels.light_dn, pixels.starts), -np.inf)
    chosen = np.zeros_like(kept)
    chosen[np.argsort(-total, kind="stable")[:count]] = True
    return chosen
