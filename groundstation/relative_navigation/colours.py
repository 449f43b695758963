"""Coloured markers: which point a blob is, by its hue or by a test trained from clicks.

A test looks at the share of blue, green and red, which does not change with brightness.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.outlines import Blob, inside

Floats = NDArray[np.float64]
Picture = NDArray[np.uint8]

LEAST_SPREAD = 0.02
"""Of a share: a few clicks do not know how it scatters."""
GATE = 16.0
"""Squared distance in sigmas within which a colour is the marker's."""
LEAST_SATURATION = 0.25
MOST_HUE_OFF_DEG = 25.0


@dataclass(frozen=True, slots=True, eq=False)
class ColourTest:
    """What colour a marker has.

    Attributes:
        mean: Shares of green and red, (2,).
        covariance: Of them, (2, 2).
    """

    mean: Floats
    covariance: Floats

    def distance(self, shares: Floats) -> float:
        """Squared distance in sigmas of shares (2,)."""
        off = shares - self.mean
        return float(off @ np.linalg.solve(self.covariance, off))


def train(colours: Picture) -> ColourTest:
    """Return the test for pixels (n, 3), blue-green-red, that were clicked on a marker.

    Raises:
        ValueError: None was clicked, or only black ones.
    """
    if not len(colours) or not colours.any():
        raise ValueError("a colour needs at least one pixel that is not black")
    shares = np.array([shares_of(each[None, None]) for each in colours if each.any()])
    spread = LEAST_SPREAD**2 * np.eye(2)
    if len(shares) > 2:
        spread = spread + np.cov(shares.T)
    return ColourTest(shares.mean(axis=0), spread)


def shares_of(pixels: Picture) -> Floats:
    """Return the shares of green and red (2,) in the sum of pixels (..., 3), brighter ones counting more."""
    total = pixels.reshape(-1, 3).astype(np.float64).sum(axis=0)
    found: Floats = total[1:] / max(1.0, float(total.sum()))
    return found


def hue_deg(pixels: Picture) -> tuple[float, float]:
    """Return hue (0 to 360 deg: red 0, green 120, blue 240) and saturation (0 to 1) of the mean of pixels."""
    mean = pixels.reshape(-1, 3).astype(np.float64).mean(axis=0)
    hue, saturation, _ = cv2.cvtColor((mean / 255.0).astype(np.float32)[None, None], cv2.COLOR_BGR2HSV)[0, 0]
    return float(hue), float(saturation)


def labels_by_tests(
    picture: Picture, blobs: Sequence[Blob], tests: Sequence[ColourTest]
) -> NDArray[np.int64]:
    """Return which test each blob passes best, (n,), -1 for none."""
    labels = np.full(len(blobs), -1, dtype=np.int64)
    for row, blob in enumerate(blobs):
        shares = shares_of(_pixels(picture, blob))
        distances = [test.distance(shares) for test in tests]
        best = int(np.argmin(distances))
        if distances[best] < GATE:
            labels[row] = best
    return labels


def labels_by_hue(picture: Picture, blobs: Sequence[Blob], hues_deg: Sequence[float]) -> NDArray[np.int64]:
    """Return which hue each blob has, (n,), -1 for none or for grey ones."""
    labels = np.full(len(blobs), -1, dtype=np.int64)
    for row, blob in enumerate(blobs):
        hue, saturation = hue_deg(_pixels(picture, blob))
        off = [abs(math.remainder(hue - each, 360.0)) for each in hues_deg]
        best = int(np.argmin(off))
        if saturation >= LEAST_SATURATION and off[best] <= MOST_HUE_OFF_DEG:
            labels[row] = best
    return labels


def _pixels(picture: Picture, blob: Blob) -> Picture:
    left, top, width, height = blob.box
    return picture[top : top + height, left : left + width][inside(blob)]
