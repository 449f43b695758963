"""Blobs of a picture: their outlines, as published all pixels of each boundary, 8-connected."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.uint8]
Ints = NDArray[np.int32]

MOST_BLOBS = 400
"""More are a texture, and no target."""


@dataclass(frozen=True, slots=True, eq=False)
class Blob:
    """One bright patch.

    Attributes:
        outline: Its boundary pixels, (k, 2), u and v.
        box: Left, top, width, height.
    """

    outline: Ints
    box: tuple[int, int, int, int]

    @property
    def touches(self) -> tuple[int, int, int, int]:
        """Left, top, and the last column and row."""
        left, top, width, height = self.box
        return left, top, left + width - 1, top + height - 1


def blobs_of(picture: Picture, level: int, glare: Picture | None = None) -> list[Blob]:
    """Return the patches of pixels at or above a grey step outside a glare; at most `MOST_BLOBS` + 1."""
    _, bright = cv2.threshold(picture, level - 1, 255, cv2.THRESH_BINARY)
    if glare is not None:
        bright[glare > 0] = 0
    outlines, _ = cv2.findContours(bright, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    found = []
    for outline in outlines[: MOST_BLOBS + 1]:
        left, top, width, height = cv2.boundingRect(outline)
        found.append(Blob(np.asarray(outline[:, 0], np.int32), (left, top, width, height)))
    return found


def inside(blob: Blob) -> NDArray[np.bool_]:
    """Return which pixels of the box belong to the patch, (height, width)."""
    left, top, width, height = blob.box
    mask = np.zeros((height, width), np.uint8)
    cv2.drawContours(mask, [blob.outline - np.array((left, top), np.int32)], -1, 1, cv2.FILLED)
    return mask > 0


def contour_mean(blob: Blob) -> tuple[float, float]:
    """Return the published centre (2.4): the mean of the boundary's pixel coordinates."""
    u, v = blob.outline.mean(axis=0).tolist()
    return u, v


def area_centre(blob: Blob) -> tuple[float, float]:
    """Return the mean of all pixels of the patch."""
    v, u = np.nonzero(inside(blob))
    return blob.box[0] + float(u.mean()), blob.box[1] + float(v.mean())
