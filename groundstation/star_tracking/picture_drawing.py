"""A star camera's picture with its notes drawn on it, for people."""

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.star_tracking.picture_notes import NO_SPOT, PictureNotes, SpotKind

_SCALE = 2  # pictures are small, names need room
_STRIP_PX = 26
_GREEN, _YELLOW, _RED, _BLUE = (90, 220, 90), (60, 210, 250), (80, 80, 250), (250, 170, 80)
_COLOURS = {
    SpotKind.LIGHT: _YELLOW,
    SpotKind.STAR: _GREEN,
    SpotKind.STRAY: _YELLOW,
    SpotKind.STREAK: _BLUE,
}
_LEGEND = "green: star   yellow: other light   blue: streak   red cross: star not seen"
_BASIS = {
    "": "   no pose, no places of stars",
    "fix": "",
    "guess": "   stars placed by the pose that fits best",
    "state": "   stars placed by what the filter believed",
}
_STRETCH_PERCENTILE = 99.9


def draw_notes(image: NDArray[np.uint8], notes: PictureNotes, caption: str) -> NDArray[np.uint8]:
    """Draw a grey picture (h, w), twice enlarged, with its lights ringed and its stars named.

    A dark picture is stretched, so that what is there can be seen. Below stand the caption and what the
    colours mean.

    Returns:
        Colour picture, uint8 (2 h + strip, 2 w, 3), OpenCV's order blue, green, red.
    """
    top = max(float(np.percentile(image, _STRETCH_PERCENTILE)), 40.0)
    stretched = np.clip(image.astype(np.float32) * (200.0 / top), 0, 255).astype(np.uint8)
    grey = cv2.resize(stretched, None, fx=_SCALE, fy=_SCALE, interpolation=cv2.INTER_NEAREST)
    canvas = cv2.cvtColor(grey, cv2.COLOR_GRAY2BGR)
    for centre, kind in zip(notes.spot_px, notes.kind, strict=True):
        cv2.circle(canvas, _pixel(centre), 11, _COLOURS[SpotKind(int(kind))], 1, cv2.LINE_AA)
    for name, place, spot in zip(notes.stars, notes.star_px, notes.spot_of_star, strict=True):
        colour = _RED if spot == NO_SPOT else _GREEN
        u, v = _pixel(place)
        if spot == NO_SPOT:
            cv2.drawMarker(canvas, (u, v), colour, cv2.MARKER_TILTED_CROSS, 14, 1, cv2.LINE_AA)
        _write(canvas, name, (u + 10, v - 8), colour, 0.4)
    strip = np.full((2 * _STRIP_PX, canvas.shape[1], 3), 25, np.uint8)
    _write(strip, caption, (8, 18), (240, 240, 240), 0.5)
    _write(strip, _LEGEND + _BASIS[notes.basis], (8, 18 + _STRIP_PX), (170, 170, 170), 0.45)
    return np.vstack((canvas, strip)).astype(np.uint8)


def _pixel(place: NDArray[np.float64]) -> tuple[int, int]:
    """The enlarged picture's pixel: (0, 0) of the small one is the centre of its first block."""
    u, v = _SCALE * (place + 0.5) - 0.5
    return round(float(u)), round(float(v))


def _write(
    canvas: NDArray[np.uint8], text: str, at: tuple[int, int], colour: tuple[int, int, int], size: float
) -> None:
    ascii_text = text.encode("ascii", "replace").decode()  # the drawn font knows no other letters
    cv2.putText(canvas, ascii_text, at, cv2.FONT_HERSHEY_SIMPLEX, size, colour, 1, cv2.LINE_AA)
