"""A picture in, centres out: background, glare, blobs, centres, and what is wrong with the picture."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.antennas import (
    longest,
    tip_covariances,
    tips_along_itself,
    tips_along_x,
)
from groundstation.relative_navigation.centres import DEFAULT, METHODS
from groundstation.relative_navigation.colours import ColourTest, labels_by_hue, labels_by_tests
from groundstation.relative_navigation.intensity import (
    SATURATED,
    background_of,
    glare_of,
    noise_level,
    published_level,
)
from groundstation.relative_navigation.matching import Centres
from groundstation.relative_navigation.outlines import MOST_BLOBS, Blob, blobs_of

Floats = NDArray[np.float64]
Picture = NDArray[np.uint8]

SIGMAS = 5.0
"""Of the noise: how far a pixel of a blob stands above the background."""
LEAST_SIGNIFICANCE = 8.0
"""Light of a spot over its noise: less is noise that came together."""
PUBLISHED_LEVEL = 0.4
"""Of the published threshold, 0 to 1; not published, assumed."""
FLOODED_SHARE = 0.1
"""Of a picture: more glare is the Sun in view."""
ANTENNA_RULES = {"x": tips_along_x, "own": tips_along_itself}
"""Name to where the ends of an antenna are looked for."""


class Trouble(StrEnum):
    """What is wrong with a picture; the value is for people."""

    NONE = ""
    DARK = "all dark"
    GLARE = "the Sun or its glare is in view"
    NO_SPOTS = "no light spots"
    TOO_MANY = "more light spots than any target has"
    WRONG_SIZE = "the frame has another size than the camera's"
    BROKEN = "the frame is broken"
    FROZEN = "the frame repeats the one before byte for byte"


@dataclass(frozen=True, slots=True, eq=False)
class SpotSettings:
    """How a picture is looked at.

    Attributes:
        method: Row of `centres.METHODS`.
        level: The user's own threshold, 0 darkest to 1 brightest of the picture, as published; None: from the
            noise, or for published methods `PUBLISHED_LEVEL`.
        least_radius_px: Smaller spots are left out.
        most_radius_px: Larger ones are left out.
        antennas: Points whose tips are the left and the right end of the longest outline; None: no such rule.
        antenna_rule: Row of `ANTENNA_RULES`.
        colour_tests: Of the markers, with ``colour_points``.
        hues_deg: Of the markers, instead of tests.
        colour_points: Which point each colour is.
    """

    method: str = DEFAULT
    level: float | None = None
    least_radius_px: float = 0.0
    most_radius_px: float = 60.0
    antennas: tuple[int, int] | None = None
    antenna_rule: str = "x"
    colour_tests: tuple[ColourTest, ...] = ()
    hues_deg: tuple[float, ...] = ()
    colour_points: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class SpotsSeen:
    """What a picture shows.

    Attributes:
        centres: For matching.
        radii: Of them, px, (k,).
        trouble: What is wrong.
        glare: Share of the picture that is masked.
        height: Grey steps that resolved spots stand out by; None where none is resolved.
    """

    centres: Centres
    radii: Floats
    trouble: Trouble
    glare: float = 0.0
    height: float | None = None


class SpotFinder:
    """Looks at the pictures of one camera, and remembers how bright its target's spots are.

    Args:
        settings: How to look.
    """

    def __init__(self, settings: SpotSettings | None = None) -> None:
        self._settings = settings or SpotSettings()
        self._height: float | None = None

    def look(self, picture: Picture) -> SpotsSeen:
        """Return the centres of the next picture, grey (h, w) or in blue-green-red (h, w, 3)."""
        seen = look_for_spots(picture, self._settings, self._height)
        if seen.height is not None:
            self._height = seen.height
        return seen


def look_for_spots(picture: Picture, settings: SpotSettings, height: float | None = None) -> SpotsSeen:
    """Return the centres of a picture.

    Args:
        picture: Grey (h, w), or in blue-green-red (h, w, 3).
        settings: How to look.
        height: Grey steps that resolved spots of earlier pictures stood out by; None: unknown.
    """
    grey = picture if picture.ndim == 2 else np.asarray(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), np.uint8)
    method = METHODS[settings.method]
    background = background_of(grey)
    if background.saturated > FLOODED_SHARE:
        return nothing(Trouble.GLARE, background.saturated)
    if background.brightest < background.level + SIGMAS * background.sigma:
        return nothing(Trouble.DARK if background.level < 40.0 else Trouble.NO_SPOTS)
    glare = glare_of(grey) if background.brightest >= SATURATED else None
    share = 0.0 if glare is None else cv2.countNonZero(glare) / grey.size
    if share > FLOODED_SHARE:
        return nothing(Trouble.GLARE, share)
    if settings.level is not None or method.is_published:
        ratio = PUBLISHED_LEVEL if settings.level is None else settings.level
        level = published_level(grey, ratio)
    else:
        level = noise_level(background, SIGMAS)
    blobs = blobs_of(grey, level, glare)
    if len(blobs) > MOST_BLOBS:
        return nothing(Trouble.TOO_MANY, share)
    pixels, covariances = np.empty((0, 2)), np.empty((0, 2, 2))
    points: NDArray[np.int64] = np.empty(0, np.int64)
    radii, resolved = np.empty(0), None
    if settings.antennas is not None:
        best = longest(blobs)
        if best is not None:
            pixels = ANTENNA_RULES[settings.antenna_rule](blobs.pop(best))
            covariances, radii = tip_covariances(), np.zeros(2)
            points = np.array(settings.antennas, dtype=np.int64)
    blobs = [blob for blob in blobs if not _is_cut(blob, grey.shape)]
    if blobs:
        found = method.find(grey, blobs, background, height)
        resolved = found.height
        good = (found.significance >= LEAST_SIGNIFICANCE) & (found.radii <= settings.most_radius_px)
        good &= found.radii >= settings.least_radius_px
        kept = np.flatnonzero(good)
        pixels = np.concatenate((pixels, found.pixels[kept]))
        covariances = np.concatenate((covariances, found.covariances[kept]))
        radii = np.concatenate((radii, found.radii[kept]))
        points = np.concatenate((points, _labels(picture, [blobs[i] for i in kept], settings)))
    if not len(pixels):
        return nothing(Trouble.GLARE if share > 0.0 else Trouble.NO_SPOTS, share)
    labels = points if settings.colour_points and np.any(points >= 0) else None
    return SpotsSeen(Centres(pixels, covariances, labels), radii, Trouble.NONE, share, resolved)


def nothing(trouble: Trouble, glare: float = 0.0) -> SpotsSeen:
    """Return what a picture without spots shows."""
    return SpotsSeen(Centres(np.empty((0, 2)), np.empty((0, 2, 2))), np.empty(0), trouble, glare)


def _labels(picture: Picture, blobs: list[Blob], settings: SpotSettings) -> NDArray[np.int64]:
    """Points by colour: each colour names one, the blob nearest to its test first."""
    labels = np.full(len(blobs), -1, dtype=np.int64)
    if picture.ndim != 3 or not settings.colour_points:
        return labels
    if settings.colour_tests:
        colours = labels_by_tests(picture, blobs, settings.colour_tests)
    else:
        colours = labels_by_hue(picture, blobs, settings.hues_deg)
    for colour, point in enumerate(settings.colour_points):
        rows = np.flatnonzero(colours == colour)
        if len(rows) == 1:
            labels[rows[0]] = point
    return labels


def _is_cut(blob: Blob, shape: tuple[int, ...]) -> bool:
    """Whether the edge of the picture cuts a blob: its centre lies elsewhere."""
    left, top, right, bottom = blob.touches
    return left <= 0 or top <= 0 or right >= shape[1] - 1 or bottom >= shape[0] - 1
