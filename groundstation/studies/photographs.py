"""Pictures of a camera in a report, side by side, with what was found in them drawn over."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.watch.page import svg
from groundstation.watch.page.panel import WIDTH

Floats = NDArray[np.float64]
Picture = NDArray[np.uint8]
QUALITY = 88
GAP = 10.0


@dataclass
class Photograph:
    """A picture, or a part of it.

    Args:
        picture: Grey, (h, w).
        crop: Left, top, width and height of what is shown.
        width: Of the place in the report; what is drawn over is as thick whatever the crop.
    """

    picture: Picture
    crop: tuple[int, int, int, int]
    width: float
    _parts: list[str] = field(default_factory=list)

    @property
    def height(self) -> float:
        """Of the place in the report."""
        return self.width * self.crop[3] / self.crop[2]

    def place(self, pixels: Floats) -> Floats:
        """Where pixels (n, 2) lie in the report; (0, 0) is the centre of the top-left one."""
        left, top, width, _ = self.crop
        found: Floats = (np.asarray(pixels, float) + 0.5 - (left, top)) * (self.width / width)
        return found

    def crosses(self, pixels: Floats, kind: str, size: float = 5.0) -> None:
        """Draw a cross at each pixel (n, 2)."""
        form = "M{0} {1}l{2} {2}m0-{2}l-{2} {2}"
        ways = (
            form.format(*map(svg.number, (u - size, v - size, 2.0 * size))) for u, v in self._places(pixels)
        )
        self._parts.append(svg.path("".join(ways), f"cross {kind}"))

    def asterisks(self, pixels: Floats, kind: str) -> None:
        """Draw an asterisk at each pixel (n, 2)."""
        form = "M{0} {1}m-5 0h10m-7.5-4.3l5 8.6m0-8.6l-5 8.6"
        ways = (form.format(svg.number(u), svg.number(v)) for u, v in self._places(pixels))
        self._parts.append(svg.path("".join(ways), f"cross {kind}"))

    def outlines(self, paths: Sequence[NDArray[np.int32]], kind: str) -> None:
        """Draw closed lines through boundary pixels, each (n, 2)."""
        ways = (svg.way(*self.place(path.astype(float)).T) + "Z" for path in paths)
        self._parts.append(svg.path("".join(ways), f"line {kind}"))

    def _places(self, pixels: Floats) -> list[list[float]]:
        found: list[list[float]] = self.place(pixels).tolist()
        return found

    def drawn(self, x: float) -> str:
        """The picture and what lies over it, its left edge at x."""
        left, top, width, height = self.crop
        cut = np.ascontiguousarray(self.picture[top : top + height, left : left + width])
        _, data = cv2.imencode(".jpg", cut, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
        text = base64.b64encode(data.tobytes()).decode()
        size = f'width="{svg.number(self.width)}" height="{svg.number(self.height)}"'
        image = f'<image {size} preserveAspectRatio="none" href="data:image/jpeg;base64,{text}"/>'
        return f'<g transform="translate({svg.number(x)} 0)">{image}{"".join(self._parts)}</g>'


def side_by_side(photographs: Sequence[Photograph], label: str) -> str:
    """Return photographs of one row.

    Args:
        photographs: From the left.
        label: What they show, for those who cannot see them.
    """
    parts, x = [], 0.0
    for each in photographs:
        parts.append(each.drawn(x))
        x += each.width + GAP
    return svg.picture(parts, WIDTH, max(each.height for each in photographs), label)


def column(count: int) -> float:
    """Width of one of so many photographs in a row."""
    return (WIDTH - GAP * (count - 1)) / count


def box_around(pixels: Floats, room: float, size: tuple[int, int]) -> tuple[int, int, int, int]:
    """Left, top, width and height around pixels (n, 2), inside a picture of a size."""
    low = np.maximum(np.floor(pixels.min(axis=0) - room), 0).astype(int)
    high = np.minimum(np.ceil(pixels.max(axis=0) + room), np.array(size)).astype(int)
    return int(low[0]), int(low[1]), int(high[0] - low[0]), int(high[1] - low[1])
