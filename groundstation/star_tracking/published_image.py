"""The published steps from a picture to star centres: normalise, cut off below a level, weighted centroids.

As published: the least and the largest intensity of the picture are found and it is normalised by them;
pixels below a level become zero; neighbouring pixels that are left form a star, whose centre is
sum(I x) / sum(I), sum(I y) / sum(I). Not published: the level, how it follows from the noise, and which
pixels count as neighbours (here all eight). A single bright pixel is a star like any other.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.star_tracking.detection import PictureError, Spots
from groundstation.star_tracking.published_settings import LEVEL_RATIO

CENTRE_SIGMA_PX = 0.1
"""The method states no error of a centre; this one stands in its place."""
MOST_SPOTS = 250
"""The brightest so many are kept: no ceiling shows more, a picture of noise shows thousands."""
_NEIGHBOURS = 8


def published_spots(image: NDArray[np.uint8], level_ratio: float = LEVEL_RATIO) -> Spots:
    """Find the stars of a picture.

    Args:
        image: Grey, 8 bit, shape (rows, columns).
        level_ratio: Normalised intensity below which a pixel becomes zero.

    Raises:
        PictureError: The picture is not grey or not 8 bit.
        ValueError: The level does not lie between 0 and 1.
    """
    if not 0.0 < level_ratio < 1.0:
        raise ValueError(f"level_ratio must lie between 0 and 1, found {level_ratio:g}")
    if image.ndim != 2 or image.dtype != np.uint8:
        raise PictureError("unusable picture: expected grey, 8 bit")
    least, largest = float(image.min()), float(image.max())
    if largest <= least:
        return _spots(np.zeros(0), np.zeros(0), np.zeros(0), least)
    intensity = (image.astype(np.float64) - least) / (largest - least)
    intensity[intensity < level_ratio] = 0.0
    count, label = cv2.connectedComponents((intensity > 0.0).view(np.uint8), connectivity=_NEIGHBOURS)
    row, column = np.nonzero(intensity)
    light, group = intensity[row, column], label[row, column]
    flux = np.bincount(group, light, count)[1:]
    u_px = np.bincount(group, light * column, count)[1:] / flux
    v_px = np.bincount(group, light * row, count)[1:] / flux
    order = np.argsort(-flux, kind="stable")[:MOST_SPOTS]
    flux_dn = np.asarray(flux[order] * (largest - least), dtype=np.float64)
    return _spots(u_px[order], v_px[order], flux_dn, least)


def _spots(
    u_px: NDArray[np.float64], v_px: NDArray[np.float64], flux_dn: NDArray[np.float64], background_dn: float
) -> Spots:
    count = len(u_px)
    return Spots(
        u_px,
        v_px,
        flux_dn,
        np.tile([CENTRE_SIGMA_PX**2, 0.0, CENTRE_SIGMA_PX**2], (count, 1)),
        np.ones(count),
        np.zeros((count, 2)),
        background_dn,
        0.0,
    )
