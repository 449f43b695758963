"""Bytes of a picture to a grey or colour image: raw, JPEG, PNG; pure."""

import math
from collections.abc import Callable, Mapping

import cv2
import numpy as np
from numpy.typing import NDArray

MONO8 = "application/x-mono8"
BGR8 = "application/x-bgr8"
_MAX_SIDE_PX = 16384


def decode_picture(headers: Mapping[str, str], body: bytes, *, is_colour: bool = False) -> NDArray[np.uint8]:
    """The image of one part of a stream, uint8, perhaps read-only.

    Args:
        headers: Lower-case names; `content-type` chooses the decoder.
        body: One picture.
        is_colour: Give shape (height, width, 3), blue-green-red, instead of grey (height, width).

    Raises:
        ValueError: It is no whole picture of a known type, or grey where colour is wanted.
    """
    content_type = headers.get("content-type", "").partition(";")[0].strip().lower()
    if content_type not in _DECODERS:
        raise ValueError(f"content type {content_type!r} is none of {', '.join(_DECODERS)}")
    image = _DECODERS[content_type](headers, body, is_colour)
    return to_colour(image) if is_colour else to_mono(image)


def to_colour(image: NDArray[np.generic]) -> NDArray[np.uint8]:
    """A picture as OpenCV captured it, in colour: shape (height, width, 3) in BGR.

    Raises:
        ValueError: It is grey, or not of 8 bits.
    """
    if image.dtype != np.uint8 or image.size == 0 or image.ndim != 3 or image.shape[2] != 3:
        raise ValueError(f"a picture of {image.dtype} {image.shape} is not one of 8 bits in colour")
    return image.astype(np.uint8, copy=False)


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


def _decode_mono8(headers: Mapping[str, str], body: bytes, _is_colour: bool) -> NDArray[np.uint8]:
    return _raw(headers, body, ())


def _decode_bgr8(headers: Mapping[str, str], body: bytes, _is_colour: bool) -> NDArray[np.uint8]:
    return _raw(headers, body, (3,))


def _raw(headers: Mapping[str, str], body: bytes, colours: tuple[int, ...]) -> NDArray[np.uint8]:
    sides = [headers.get(name, "") for name in ("x-height", "x-width")]
    if not all(side.isdecimal() and 0 < int(side) <= _MAX_SIDE_PX for side in sides):
        raise ValueError(f"X-Height and X-Width of a raw picture are {sides}")
    height, width = int(sides[0]), int(sides[1])
    shape = (height, width, *colours)
    if len(body) != math.prod(shape):
        raise ValueError(f"a raw picture of {' x '.join(map(str, shape))} has {len(body)} bytes")
    return np.frombuffer(body, np.uint8).reshape(shape)


def _decode_jpeg(_headers: Mapping[str, str], body: bytes, is_colour: bool) -> NDArray[np.uint8]:
    whole = body.rstrip(b"\0\r\n")  # some cameras pad
    if not (whole.startswith(b"\xff\xd8") and whole.endswith(b"\xff\xd9")):
        raise ValueError("a JPEG is cut short")  # the decoder would fill the rest with grey
    return _decode_file(whole, is_colour)


def _decode_png(_headers: Mapping[str, str], body: bytes, is_colour: bool) -> NDArray[np.uint8]:
    if b"IEND" not in body[-12:]:
        raise ValueError("a PNG is cut short")
    return _decode_file(body, is_colour)


def _decode_file(body: bytes, is_colour: bool) -> NDArray[np.uint8]:
    kind = cv2.IMREAD_ANYCOLOR if is_colour else cv2.IMREAD_GRAYSCALE
    image = cv2.imdecode(np.frombuffer(body, np.uint8), kind)
    if image is None:
        raise ValueError(f"{len(body)} bytes are no picture")
    return np.asarray(image, dtype=np.uint8)


_DECODERS: dict[str, Callable[[Mapping[str, str], bytes, bool], NDArray[np.uint8]]] = {
    MONO8: _decode_mono8,
    BGR8: _decode_bgr8,
    "image/jpeg": _decode_jpeg,
    "image/png": _decode_png,
}
