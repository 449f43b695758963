"""Bytes of a picture to a mono image: raw, JPEG, PNG; pure."""

from collections.abc import Callable, Mapping

import cv2
import numpy as np
from numpy.typing import NDArray

MONO8 = "application/x-mono8"
_MAX_SIDE_PX = 16384


def decode_picture(headers: Mapping[str, str], body: bytes) -> NDArray[np.uint8]:
    """The image of one part of a stream, uint8, shape (height, width), perhaps read-only.

    Args:
        headers: Lower-case names; `content-type` chooses the decoder.
        body: One picture.

    Raises:
        ValueError: It is no whole picture of a known type.
    """
    content_type = headers.get("content-type", "").partition(";")[0].strip().lower()
    if content_type not in _DECODERS:
        raise ValueError(f"content type {content_type!r} is none of {', '.join(_DECODERS)}")
    return _DECODERS[content_type](headers, body)


def to_mono(image: NDArray[np.generic]) -> NDArray[np.uint8]:
    """A picture as OpenCV captured it, in grey: shape (height, width) or (height, width, 3) in BGR.

    Raises:
        ValueError: It has another shape or is not of 8 bits.
    """
    if image.dtype != np.uint8 or image.size == 0:
        raise ValueError(f"a picture of {image.dtype} {image.shape} is not one of 8 bits")
    if image.ndim == 2:
        return image.astype(np.uint8, copy=False)
    if image.ndim == 3 and image.shape[2] == 3:
        return cv2.cvtColor(image.astype(np.uint8, copy=False), cv2.COLOR_BGR2GRAY).astype(
            np.uint8, copy=False
        )
    raise ValueError(f"a picture of shape {image.shape} is neither grey nor colour")


def _decode_mono8(headers: Mapping[str, str], body: bytes) -> NDArray[np.uint8]:
    sides = [headers.get(name, "") for name in ("x-height", "x-width")]
    if not all(side.isdecimal() and 0 < int(side) <= _MAX_SIDE_PX for side in sides):
        raise ValueError(f"X-Height and X-Width of a raw picture are {sides}")
    height, width = int(sides[0]), int(sides[1])
    if len(body) != height * width:
        raise ValueError(f"a raw picture of {width} x {height} has {len(body)} bytes")
    return np.frombuffer(body, np.uint8).reshape(height, width)


def _decode_jpeg(_headers: Mapping[str, str], body: bytes) -> NDArray[np.uint8]:
    whole = body.rstrip(b"\0\r\n")  # some cameras pad
    if not (whole.startswith(b"\xff\xd8") and whole.endswith(b"\xff\xd9")):
        raise ValueError("a JPEG is cut short")  # the decoder would fill the rest with grey
    return _decode_file(whole)


def _decode_png(_headers: Mapping[str, str], body: bytes) -> NDArray[np.uint8]:
    if b"IEND" not in body[-12:]:
        raise ValueError("a PNG is cut short")
    return _decode_file(body)


def _decode_file(body: bytes) -> NDArray[np.uint8]:
    image = cv2.imdecode(np.frombuffer(body, np.uint8), cv2.IMREAD_GRAYSCALE)
    if image is None:
        raise ValueError(f"{len(body)} bytes are no picture")
    return to_mono(image)


_DECODERS: dict[str, Callable[[Mapping[str, str], bytes], NDArray[np.uint8]]] = {
    MONO8: _decode_mono8,
    "image/jpeg": _decode_jpeg,
    "image/png": _decode_png,
}
