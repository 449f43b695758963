"""Background light and noise of a picture, on a coarse grid.

The picture is smoothed by two 3x3 box sums (triangular weights 1 2 3 2 1, total 81), which is close
to the matched filter of a star and stays in 16-bit integers. Background is the median of coarse cell
means, so that a star in a cell does not lift it; noise is a line in the background (read noise plus
shot noise), fitted to a thinned sample of the smoothed picture.
"""

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.star_tracking.robust import middle_value

WEIGHT_SUM = 81.0  # of the smoothing kernel, per axis 1+2+3+2+1 = 9
WEIGHT_SQUARE_SUM = 361.0  # per axis 1+4+9+4+1 = 19: noise of the sum over noise of a pixel, squared
_CELL_PX = 16
_THIN = (7, 11)  # every 7th row, every 11th column: coprime to the cells and to a colour mosaic
_MIN_VARIANCE_DN2 = 1.0 / 12.0  # an 8-bit picture is never better than its rounding


@dataclass(frozen=True, slots=True, eq=False)
class Levels:
    """The smoothed picture with its background and noise.

    Attributes:
        smooth: Smoothed picture, (h, w) uint16, 81 times DN.
        background: Background in the same unit, (h, w) uint16.
        background_coarse: The same on the coarse grid, float32.
        variance_floor_dn2: Pixel variance at zero background.
        variance_slope_dn: Growth of the pixel variance per DN of background.
        background_dn: Median background, DN.
        noise_dn: Standard deviation of a pixel there, DN.
    """

    smooth: NDArray[np.uint16]
    background: NDArray[np.uint16]
    background_coarse: NDArray[np.float32]
    variance_floor_dn2: float
    variance_slope_dn: float
    background_dn: float
    noise_dn: float

    def threshold(self, sigmas: float) -> NDArray[np.uint16]:
        """Level that noise exceeds with ``sigmas`` standard deviations, like ``smooth``."""
        mean_dn = self.background_coarse / np.float32(WEIGHT_SUM)
        variance = self.variance_floor_dn2 + self.variance_slope_dn * mean_dn
        coarse = self.background_coarse + sigmas * np.sqrt(WEIGHT_SQUARE_SUM * variance)
        return _full_size(coarse, self.smooth.shape)


def measure_levels(image: NDArray[np.uint8]) -> Levels:
    """Measure background and noise of a grey picture (h, w) uint8."""
    rows, columns = image.shape
    once = cv2.boxFilter(image, cv2.CV_16U, (3, 3), normalize=False)
    smooth = np.asarray(cv2.boxFilter(once, cv2.CV_16U, (3, 3), normalize=False), dtype=np.uint16)
    grid = (max(2, round(columns / _CELL_PX)), max(2, round(rows / _CELL_PX)))
    coarse = cv2.medianBlur(cv2.resize(smooth, grid, interpolation=cv2.INTER_AREA), 5).astype(np.float32)
    background = _full_size(coarse, smooth.shape)
    thin = (slice(2, None, _THIN[0]), slice(2, None, _THIN[1]))
    level = background[thin].astype(np.float32).ravel()
    deviation = smooth[thin].astype(np.float32).ravel() - level
    floor, slope = _noise_line(deviation, level)
    background_dn = middle_value(coarse) / WEIGHT_SUM
    noise_dn = math.sqrt(floor + slope * background_dn)
    return Levels(smooth, background, coarse, floor, slope, background_dn, noise_dn)


def _full_size(coarse: NDArray[np.floating], shape: tuple[int, ...]) -> NDArray[np.uint16]:
    grown = cv2.resize(
        np.clip(coarse, 0.0, 65535.0).astype(np.uint16), (shape[1], shape[0]), interpolation=cv2.INTER_LINEAR
    )
    return np.asarray(grown, dtype=np.uint16)


def _noise_line(deviation: NDArray[np.float32], level: NDArray[np.float32]) -> tuple[float, float]:
    """Fit pixel variance = floor + slope * background (DN), stars clipped away."""
    size = np.abs(deviation)
    scale = 1.4826 * middle_value(size)
    kept = size <= max(4.0 * scale, 1.0)
    square = (deviation[kept].astype(np.float64) ** 2) / WEIGHT_SQUARE_SUM
    mean_dn = level[kept].astype(np.float64) / WEIGHT_SUM
    centre, total = float(mean_dn.mean()), float(square.mean())
    spread = mean_dn - centre
    denominator = float(spread @ spread)
    slope = float(spread @ square) / denominator if denominator > 1e-9 * len(mean_dn) else 0.0
    slope = min(max(slope, 0.0), total / max(centre, 1e-6))  # both terms are physical: none below zero
    return max(total - slope * centre, _MIN_VARIANCE_DN2), slope
