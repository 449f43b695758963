"""Pictures of a camera in a report, with what was found in them drawn over."""

from __future__ import annotations

import base64
from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.watch.page import svg

Floats = NDArray[np.float64]
Picture = NDArray[np.uint8]
QUALITY = 88


def photograph(picture: Picture, marks: Sequence[str], label: str, crop: tuple[int, int, int, int]) -> str:
    """Return a picture as SVG, in pixels of the cut-out.

    Args:
        picture: Grey, (h, w).
        marks: Elements drawn over it, in pixels of the whole picture.
        label: What it shows, for those who cannot see it.
        crop: Left, top, width and height of what is shown.
    """
    left, top, width, height = crop
    cut = np.ascontiguousarray(picture[top : top + height, left : left + width])
    _, data = cv2.imencode(".jpg", cut, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
    text = base64.b64encode(data.tobytes()).decode()
    size = f'width="{cut.shape[1]}" height="{cut.shape[0]}"'
    image = f'<image {size} href="data:image/jpeg;base64,{text}"/>'
    moved = f'<g transform="translate({-left} {-top})">{"".join(marks)}</g>'
    return svg.picture([image, moved], float(cut.shape[1]), float(cut.shape[0]), label)


def crosses(pixels: Floats, kind: str, size: float = 4.0) -> str:
    """A cross at each pixel (n, 2)."""
    form = "M{0} {1}l{2} {2}m0-{2}l-{2} {2}"
    ways = (
        form.format(svg.number(u - size), svg.number(v - size), svg.number(2.0 * size))
        for u, v in pixels.tolist()
    )
    return svg.path("".join(ways), f"cross {kind}")


def asterisks(pixels: Floats, kind: str) -> str:
    """An asterisk at each pixel (n, 2)."""
    form = "M{0} {1}m-5 0h10m-7.5-4.3l5 8.6m0-8.6l-5 8.6"
    ways = (form.format(svg.number(u), svg.number(v)) for u, v in pixels.tolist())
    return svg.path("".join(ways), f"cross {kind}")


def outlines(paths: Sequence[NDArray[np.int32]], kind: str) -> str:
    """Closed lines through boundary pixels, each (n, 2)."""
    ways = (svg.way(path[:, 0].astype(float), path[:, 1].astype(float)) + "Z" for path in paths)
    return svg.path("".join(ways), f"line {kind}")


def box_around(pixels: Floats, room: float, size: tuple[int, int]) -> tuple[int, int, int, int]:
    """Left, top, width and height around pixels (n, 2), inside a picture of a size."""
    low = np.maximum(np.floor(pixels.min(axis=0) - room), 0).astype(int)
    high = np.minimum(np.ceil(pixels.max(axis=0) + room), np.array(size)).astype(int)
    return int(low[0]), int(low[1]), int(high[0] - low[0]), int(high[1] - low[1])
