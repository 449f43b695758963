"""Light spots of a picture in NumPy and OpenCV: what the core's detection must agree with."""

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.star_tracking.detection import DetectorSettings, Spots
from oracles.background import WEIGHT_SUM, Levels, measure_levels
from oracles.spot_fit import SpotPixels, fit_spots

_GROW = np.ones((3, 3), np.uint8)
_MAX_GROUPS = 20_000  # with more of them the picture is flooded


class OracleDetector:
    """Finds the light spots of grey pictures, as ``Detector`` does."""

    def __init__(self, settings: DetectorSettings | None = None) -> None:
        self._settings = settings or DetectorSettings()

    def find(self, image: NDArray[np.uint8]) -> Spots:
        """Find the light spots of a grey picture (h, w), uint8, at least 32 x 32."""
        return _find(image, self._settings)


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
        covariance_px2=fitted.covariance_px2[order],
        elongation=fitted.elongation[order],
        streak_px=fitted.streak_px[order],
        background_dn=levels.background_dn,
        noise_dn=levels.noise_dn,
        hot_pixels=hot,
        cut_by_edge=cut,
    )


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
