"""THE TABLE of ways from blobs to centres with covariance.

====================  ====================================================================================
``grey``              disks with a soft edge fitted to the grey values (default)
``intensity``         mean of the pixels weighted by what they hold above the background
``contour``           published: mean of the boundary's pixels, after the published threshold
``area``              mean of all pixels of the blob, after the published threshold
====================  ====================================================================================
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.disk_fit import UNRESOLVED_PX, fit_disks
from groundstation.relative_navigation.intensity import Background
from groundstation.relative_navigation.outlines import Blob, area_centre, contour_mean

Floats = NDArray[np.float64]
Picture = NDArray[np.uint8]

OBLONG = 2.5
"""Ratio of a blob's sides from which it is no disk."""
LARGEST_DISK_PX = 30.0
POOR_FIT = 40.0
"""Misfit at which a spot is no disk, and keeps its weighted mean."""
CONTOUR_SIGMA_PX = 0.17
"""Of a mean of boundary pixels, as the reference measured it at 10 to 15 m."""


@dataclass(frozen=True, slots=True, eq=False)
class BlobCentres:
    """Centres of blobs, in their order.

    Attributes:
        pixels: (n, 2).
        covariances: (n, 2, 2).
        significance: Light above the background in sigmas of its own noise, (n,).
        radii: Rough radii, px, (n,).
    """

    pixels: Floats
    covariances: Floats
    significance: Floats
    radii: Floats
    height: float | None = None
    """What resolved spots stand out by, grey steps; None where none is resolved."""


def weighted_centres(
    picture: Picture, blobs: Sequence[Blob], background: Background, height: float | None = None
) -> BlobCentres:
    """Return means weighted by the light above the background, each in its blob's box and a pixel around."""
    del height
    pixels, covariances = np.empty((len(blobs), 2)), np.empty((len(blobs), 2, 2))
    significance, radii = np.empty(len(blobs)), np.empty(len(blobs))
    rows, columns = picture.shape
    for row, blob in enumerate(blobs):
        left, top, right, bottom = blob.touches
        left, top = max(0, left - 1), max(0, top - 1)
        right, bottom = min(columns - 1, right + 1), min(rows - 1, bottom + 1)
        light = picture[top : bottom + 1, left : right + 1] - background.level
        down, across = light.sum(axis=1), light.sum(axis=0)
        total = max(float(down.sum()), 1e-9)
        us, vs = np.arange(left, right + 1), np.arange(top, bottom + 1)
        u = min(max(float(across @ us) / total, left), right)
        v = min(max(float(down @ vs) / total, top), bottom)
        spread = background.sigma**2 / total**2
        pixels[row] = u, v
        covariances[row] = np.diag(
            (
                spread * len(vs) * float(((us - u) ** 2).sum()) + 1.0 / 144.0,
                spread * len(us) * float(((vs - v) ** 2).sum()) + 1.0 / 144.0,
            )
        )
        significance[row] = total / (background.sigma * math.sqrt(light.size))
        peak = max(float(light.max()), 1.0)
        radii[row] = math.sqrt(max(total / peak, 1.0) / math.pi)
    return BlobCentres(pixels, covariances, significance, radii)


def grey_centres(
    picture: Picture, blobs: Sequence[Blob], background: Background, height: float | None = None
) -> BlobCentres:
    """Return centres of fitted disks; oblong, huge or badly fitting blobs keep their weighted mean.

    Args:
        picture: Grey, (h, w).
        blobs: Of it.
        background: Of it.
        height: What unresolved spots would stand out by if they were larger; None: as the brightest pixel.
    """
    sides = np.array([blob.box[2:] for blob in blobs], dtype=np.float64)
    longer, shorter = sides.max(axis=1), sides.min(axis=1)
    count = len(blobs)
    pixels, covariances = np.empty((count, 2)), np.empty((count, 2, 2))
    significance, radii = np.zeros(count), 0.5 * (longer + shorter) / 2.0
    is_fitted = np.zeros(count, dtype=np.bool_)
    disk = (longer <= OBLONG * shorter) & (longer < 2.0 * LARGEST_DISK_PX)
    start = np.array([blob.outline.mean(axis=0) for blob in blobs])
    resolved: list[float] = []
    for group in (np.flatnonzero(disk & (radii < 3.0)), np.flatnonzero(disk & (radii >= 3.0))):
        if not len(group):
            continue
        fits = fit_disks(picture, start[group], radii[group], background.level, background.sigma, height)
        moved = np.abs(fits.centres - start[group]).max(axis=1)
        good = (fits.misfits < POOR_FIT) & (moved < 1.2 + 0.3 * radii[group])
        chosen = group[good]
        is_fitted[chosen] = True
        pixels[chosen], covariances[chosen] = fits.centres[good], fits.covariances[good]
        area = math.pi * np.square(fits.radii[good])
        significance[chosen] = fits.heights[good] * area / (background.sigma * np.sqrt(area + 9.0))
        radii[chosen] = fits.radii[good]
        resolved += fits.heights[good & (fits.radii > UNRESOLVED_PX)].tolist()
    rest = np.flatnonzero(~is_fitted)
    if len(rest):
        rough = weighted_centres(picture, [blobs[i] for i in rest.tolist()], background)
        pixels[rest], covariances[rest] = rough.pixels, rough.covariances
        significance[rest], radii[rest] = rough.significance, rough.radii
    middle = float(np.median(resolved)) if resolved else None
    return BlobCentres(pixels, covariances, significance, radii, middle)


def contour_centres(
    picture: Picture, blobs: Sequence[Blob], background: Background, height: float | None = None
) -> BlobCentres:
    """Return the published means of boundary pixels; their covariance is what was measured of them."""
    del height
    return _plain(picture, blobs, background, contour_mean)


def area_centres(
    picture: Picture, blobs: Sequence[Blob], background: Background, height: float | None = None
) -> BlobCentres:
    """Return means of all pixels of each blob."""
    del height
    return _plain(picture, blobs, background, area_centre)


def _plain(
    picture: Picture,
    blobs: Sequence[Blob],
    background: Background,
    centre: Callable[[Blob], tuple[float, float]],
) -> BlobCentres:
    rough = weighted_centres(picture, blobs, background)
    pixels = np.array([centre(blob) for blob in blobs])
    covariances = np.broadcast_to(CONTOUR_SIGMA_PX**2 * np.eye(2), (len(blobs), 2, 2))
    return BlobCentres(pixels, covariances, rough.significance, rough.radii)


@dataclass(frozen=True, slots=True)
class CentreMethod:
    """A way from blobs to centres.

    Attributes:
        find: Does it.
        is_published: Whether the published threshold goes before.
    """

    find: Callable[[Picture, Sequence[Blob], Background, float | None], BlobCentres]
    is_published: bool


DEFAULT = "grey"
METHODS: Mapping[str, CentreMethod] = MappingProxyType(
    {
        DEFAULT: CentreMethod(grey_centres, is_published=False),
        "contour": CentreMethod(contour_centres, is_published=True),
        "area": CentreMethod(area_centres, is_published=True),
        "intensity": CentreMethod(weighted_centres, is_published=False),
    }
)
