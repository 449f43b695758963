"""Background light and noise of a picture, on a coarse grid.

The picture is smoothed by two 3x3 box sums (triangular weights 1 2 3 2 1, total 81), which is close
to the matched filter of a star and stays in 16-bit integers. Background is the median of coarse cell
means, so that a star in a cell does not lift it; noise is a line in the background (read noise plus
shot noise), fitted to a thinned sample of the smoothed picture.

Everything up to the noise line is integers, rounded in one stated way: ``core/levels.c`` gives the
same ones.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

WEIGHT_SUM = 81  # of the smoothing kernel, per axis 1+2+3+2+1 = 9
WEIGHT_SQUARE_SUM = 361  # per axis 1+4+9+4+1 = 19: noise of the sum over noise of a pixel, squared
_CELL_PX = 16
_THIN = (7, 11)  # every 7th row, every 11th column: coprime to the cells and to a colour mosaic
_MIN_VARIANCE_DN2 = 1.0 / 12.0  # an 8-bit picture is never better than its rounding
_EXACT_SINGLE = 1 << 14  # times the 1024 of the interpolation's weights: single precision is exact below


@dataclass(frozen=True, slots=True, eq=False)
class Levels:
    """The smoothed picture with its background and noise.

    Attributes:
        smooth: Smoothed picture, (h, w) uint16, 81 times DN.
        background: Background in the same unit, (h, w) uint16.
        background_coarse: The same at the centres of 16-pixel cells, uint16.
        variance_floor_dn2: Pixel variance at zero background.
        variance_slope_dn: Growth of the pixel variance per DN of background.
        background_dn: Median background, DN.
        noise_dn: Standard deviation of a pixel there, DN.
    """

    smooth: NDArray[np.uint16]
    background: NDArray[np.uint16]
    background_coarse: NDArray[np.uint16]
    variance_floor_dn2: float
    variance_slope_dn: float
    background_dn: float
    noise_dn: float

    def threshold(self, sigmas: float) -> NDArray[np.uint16]:
        """Level that noise exceeds with ``sigmas`` standard deviations, like ``smooth``."""
        mean = self.background_coarse.astype(np.float64)
        variance = self.variance_floor_dn2 + self.variance_slope_dn * (mean / WEIGHT_SUM)
        coarse = mean + sigmas * np.sqrt(WEIGHT_SQUARE_SUM * variance)
        return _full_size(np.clip(coarse, 0.0, 65535.0).astype(np.uint16), self.smooth.shape)


def measure_levels(image: NDArray[np.uint8]) -> Levels:
    """Measure background and noise of a grey picture (h, w) uint8."""
    once = cv2.boxFilter(image, cv2.CV_16U, (3, 3), normalize=False)
    smooth = np.asarray(cv2.boxFilter(once, cv2.CV_16U, (3, 3), normalize=False), dtype=np.uint16)
    coarse = np.asarray(cv2.medianBlur(_cell_means(image), 5), dtype=np.uint16)
    background = _full_size(coarse, smooth.shape)
    thin = (slice(2, None, _THIN[0]), slice(2, None, _THIN[1]))
    level = background[thin].ravel().astype(np.int64)
    floor, slope = _noise_line(smooth[thin].ravel() - level, level)
    middle = coarse.size // 2
    background_dn = float(np.partition(coarse.ravel(), middle)[middle]) / WEIGHT_SUM
    noise_dn = math.sqrt(floor + slope * background_dn)
    return Levels(smooth, background, coarse, floor, slope, background_dn, noise_dn)


def _cell_means(image: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Mean of each 16x16 cell, 81 times DN; the last cells of a row and column reach back to be whole."""
    sums = cv2.integral(image)
    top, left = (np.minimum(np.arange(0, n, _CELL_PX), n - _CELL_PX) for n in image.shape)
    rows = sums[top + _CELL_PX] - sums[top]
    cells = (rows[:, left + _CELL_PX] - rows[:, left]).astype(np.int64)
    means = (WEIGHT_SUM * cells + _CELL_PX**2 // 2) // _CELL_PX**2
    return np.asarray(means, dtype=np.uint16)


def _full_size(coarse: NDArray[np.uint16], shape: tuple[int, ...]) -> NDArray[np.uint16]:
    """Interpolate between the centres of cells, halves rounded to even."""
    is_exact = int(coarse.max()) < _EXACT_SINGLE
    grown = cv2.resize(
        coarse if is_exact else coarse.astype(np.float64),
        (coarse.shape[1] * _CELL_PX, coarse.shape[0] * _CELL_PX),
        interpolation=cv2.INTER_LINEAR,
    )
    grown = np.asarray(grown)[: shape[0], : shape[1]]
    return np.ascontiguousarray(grown if is_exact else np.rint(grown), dtype=np.uint16)


def _noise_line(deviation: NDArray[np.int64], level: NDArray[np.int64]) -> tuple[float, float]:
    """Fit pixel variance = floor + slope * background (DN), stars clipped away; both inputs 81 times DN."""
    size = np.abs(deviation)
    middle = len(size) // 2
    scale = 1.4826 * float(np.partition(size, middle)[middle])
    kept = size <= max(4.0 * scale, 1.0)
    x, y = level[kept].astype(np.float64), size[kept].astype(np.float64) ** 2
    count = float(len(x))
    # Sums of whole numbers are exact, whatever their order.
    sum_x, sum_y = float(x.sum()), float(y.sum())
    centre, total = sum_x / count / WEIGHT_SUM, sum_y / count / WEIGHT_SQUARE_SUM
    spread = (float((x * x).sum()) - sum_x * sum_x / count) / WEIGHT_SUM**2
    common = (float((x * y).sum()) - sum_x * sum_y / count) / (WEIGHT_SUM * WEIGHT_SQUARE_SUM)
    slope = common / spread if spread > 1e-9 * count else 0.0
    slope = min(max(slope, 0.0), total / max(centre, 1e-6))  # both terms are physical: none below zero
    return max(total - slope * centre, _MIN_VARIANCE_DN2), slope
