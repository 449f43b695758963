"""Brightness of a picture: background and noise, thresholds, glare.

Published: least and largest intensity become 0 and 1, and what lies below a level set by hand counts as dark.
Ours: the level stands a number of sigmas above the background, both read from the picture's own histogram.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Picture = NDArray[np.uint8]

_STRIDE = 5
"""Of the pixels that the histogram counts: some ten thousand tell the noise to a percent."""
LEAST_NOISE = 0.5
"""Rounding to whole steps alone gives 0.29."""
SATURATED = 250
GLARE_AREA_PX = 600
"""A saturated patch larger than this is no marker."""
GLARE_REACH_PX = 9
"""Around a glare its halo makes false edges."""
_QUARTILES = 1.349
"""Between the quartiles of a normal distribution, sigmas."""


@dataclass(frozen=True, slots=True)
class Background:
    """What a picture shows where nothing is.

    Attributes:
        level: Of the background.
        sigma: Of the noise.
        brightest: Of the picture.
        saturated: Share of it that is over-exposed.
    """

    level: float
    sigma: float
    brightest: int
    saturated: float = 0.0


def background_of(picture: Picture) -> Background:
    """Return background and noise of a grey picture (h, w), robust against what shines in it."""
    sample = picture[::_STRIDE, ::_STRIDE]
    counts = np.bincount(sample.ravel(), minlength=256)
    total = np.cumsum(counts)
    quarter, half, three = (_quantile(counts, total, share) for share in (0.25, 0.5, 0.75))
    sigma = max(LEAST_NOISE, (three - quarter) / _QUARTILES)
    near = slice(max(0, int(half - 3.0 * sigma)), int(half + 3.0 * sigma) + 2)
    steps = np.arange(256)[near]
    weight = counts[near]
    count = max(1, int(weight.sum()))
    mean = float(weight @ steps) / count
    spread = float(weight @ (steps - mean) ** 2) / count
    brightest = int(cv2.minMaxLoc(picture)[1])
    saturated = float(counts[SATURATED:].sum()) / float(total[-1])
    return Background(mean, max(LEAST_NOISE, min(1.5 * sigma, spread**0.5)), brightest, saturated)


def _quantile(counts: NDArray[np.int64], total: NDArray[np.int64], share: float) -> float:
    """Of a histogram, inside a step as if its pixels were spread evenly."""
    wanted = share * float(total[-1])
    step = int(np.searchsorted(total, wanted))
    before = float(total[step - 1]) if step else 0.0
    return step - 0.5 + (wanted - before) / max(1.0, float(counts[step]))


def noise_level(background: Background, sigmas: float) -> int:
    """Return the least grey step that stands so many sigmas above the background."""
    return int(np.ceil(background.level + sigmas * background.sigma))


def published_level(picture: Picture, ratio: float) -> int:
    """Return the least grey step whose normalised intensity reaches a level 0 to 1, as published."""
    low, high, _, _ = cv2.minMaxLoc(picture)
    return max(1, int(np.ceil(low + ratio * (high - low))))


def normalised(picture: Picture) -> Floats:
    """Return the published normalisation: least 0, largest 1; zeros where all is alike."""
    low, high = float(picture.min()), float(picture.max())
    if high == low:
        return np.zeros(picture.shape)
    found: Floats = (picture.astype(np.float64) - low) / (high - low)
    return found


def glare_of(picture: Picture) -> Picture | None:
    """Return a mask (255 where glare or its halo is), or None: saturated patches too large for a marker."""
    _, bright = cv2.threshold(picture, SATURATED - 1, 255, cv2.THRESH_BINARY)
    if cv2.countNonZero(bright) <= GLARE_AREA_PX:
        return None
    count, labels, stats, _ = cv2.connectedComponentsWithStats(bright)
    large = np.flatnonzero(stats[:, cv2.CC_STAT_AREA] > GLARE_AREA_PX)
    large = large[(large > 0) & (large < count)]
    if not len(large):
        return None
    mask = np.asarray(np.isin(labels, large) * np.uint8(255), dtype=np.uint8)
    side = 2 * GLARE_REACH_PX + 1
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
    return np.asarray(cv2.dilate(mask, kernel), dtype=np.uint8)
