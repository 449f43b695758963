"""Bytes of a picture to a grey or colour image: raw, JPEG, PNG; pure."""

import math
from collections.abc import Mapping

import cv2
import numpy as np
import simplejpeg
from numpy.typing import NDArray

from drivers.star_camera.jpeg_data import is_used_up
from drivers.star_camera.picture_end import (
    BYTES_PER_PIXEL,
    JPEG_START,
    MAX_SIDE_PX,
    PNG_START,
    raw_shape,
    type_in,
)
from drivers.star_camera.refusals import PictureRefused

_PNG_END = b"IEND"
_LINE_ENDS = b"\r\n"
_PADDING = b"\0\r\n"  # some cameras pad


def decode_picture(headers: Mapping[str, str], body: bytes, *, is_colour: bool = False) -> NDArray[np.uint8]:
    """The image of one part of a stream, uint8, perhaps read-only.

    Raw pictures are known by their Content-Type, others by their first bytes: senders call a JPEG
    `image/jpg`, `application/octet-stream` or nothing at all.

    Args:
        headers: Lower-case names.
        body: One picture.
        is_colour: Give shape (height, width, 3), blue-green-red, instead of grey (height, width).

    Raises:
        PictureRefused: It is no whole picture of a known type, it is damaged, or grey where colour is wanted.
    """
    if type_in(headers) in BYTES_PER_PIXEL:
        image = _raw(headers, body, BYTES_PER_PIXEL[type_in(headers)])
    else:
        body = body.lstrip(_LINE_ENDS)
        if not body:
            raise PictureRefused("a picture is cut short", "it is empty")
        if body.startswith(JPEG_START[:2]):
            image = _decode_jpeg(body, is_colour)
        elif body.startswith(PNG_START):
            image = _decode_png(body, is_colour)
        else:
            image = _unnamed_raw(headers, body)
    return to_colour(image) if is_colour else to_mono(image)


def to_colour(image: NDArray[np.generic]) -> NDArray[np.uint8]:
    """A picture as OpenCV captured it, in colour: shape (height, width, 3) in BGR.

    Raises:
        PictureRefused: It is grey, or not of 8 bits.
    """
    if image.dtype != np.uint8 or image.size == 0 or image.ndim != 3 or image.shape[2] != 3:
        raise PictureRefused(
            "not a picture in colour",
            f"a picture of {image.dtype} {image.shape} is not one of 8 bits in colour",
        )
    return image.astype(np.uint8, copy=False)


def to_mono(image: NDArray[np.generic]) -> NDArray[np.uint8]:
    """A picture as OpenCV captured it, in grey: shape (height, width) or (height, width, 3) in BGR.

    Raises:
        PictureRefused: It has another shape or is not of 8 bits.
    """
    if image.dtype != np.uint8 or image.size == 0:
        raise PictureRefused(
            "not a picture of 8 bits", f"a picture of {image.dtype} {image.shape} is not one of 8 bits"
        )
    if image.ndim == 2:
        return image.astype(np.uint8, copy=False)
    if image.ndim == 3 and image.shape[2] == 3:
        return cv2.cvtColor(image.astype(np.uint8, copy=False), cv2.COLOR_BGR2GRAY).astype(
            np.uint8, copy=False
        )
    raise PictureRefused(
        "neither grey nor colour", f"a picture of shape {image.shape} is neither grey nor colour"
    )


def _raw(headers: Mapping[str, str], body: bytes, bytes_per_pixel: int) -> NDArray[np.uint8]:
    size = raw_shape(headers)
    if size is None:
        sides = [headers.get(name, "") for name in ("x-height", "x-width")]
        raise PictureRefused("raw picture without its size", f"X-Height and X-Width are {sides}")
    shape = size if bytes_per_pixel == 1 else (*size, bytes_per_pixel)
    if len(body) != math.prod(shape):
        raise PictureRefused(
            "raw picture of another length",
            f"a raw picture of {' x '.join(map(str, shape))} has {len(body)} bytes",
        )
    return np.frombuffer(body, np.uint8).reshape(shape)


def _unnamed_raw(headers: Mapping[str, str], body: bytes) -> NDArray[np.uint8]:
    """A raw picture that is not called one: its length must be right."""
    size = raw_shape(headers)
    for bytes_per_pixel in BYTES_PER_PIXEL.values() if size is not None else ():
        if len(body) == math.prod(size or ()) * bytes_per_pixel:
            return _raw(headers, body, bytes_per_pixel)
    raise PictureRefused(
        f"neither JPEG, PNG nor raw (content type {type_in(headers)[:40]!r})", f"it begins with {body[:8]!r}"
    )


def _decode_jpeg(body: bytes, is_colour: bool) -> NDArray[np.uint8]:
    whole = body.rstrip(_PADDING)
    if not whole.endswith(b"\xff\xd9"):
        raise PictureRefused("a JPEG is cut short")  # the decoder would fill the rest with grey
    try:
        height, width, colours, _ = simplejpeg.decode_jpeg_header(whole)
        if max(height, width) > MAX_SIDE_PX:
            raise PictureRefused("a JPEG of an impossible size", f"{width} x {height} px")
        is_grey = colours == "Gray"
        # strict: what the decoder warns of has lost bytes, and all that follows may stand elsewhere
        image = simplejpeg.decode_jpeg(whole, "BGR" if is_colour and not is_grey else "GRAY", strict=True)
    except PictureRefused:
        raise
    except ValueError as error:
        raise PictureRefused("a JPEG is damaged", str(error)) from error
    if not is_used_up(whole):
        raise PictureRefused("a JPEG is damaged", "its data go on behind its last block")
    found: NDArray[np.uint8] = image[:, :, 0] if image.shape[2] == 1 else image
    return found


def _decode_png(body: bytes, is_colour: bool) -> NDArray[np.uint8]:
    if _PNG_END not in body.rstrip(_PADDING)[-12:]:
        raise PictureRefused("a PNG is cut short")
    kind = cv2.IMREAD_ANYCOLOR if is_colour else cv2.IMREAD_GRAYSCALE
    image = cv2.imdecode(np.frombuffer(body, np.uint8), kind)
    if image is None:
        raise PictureRefused("a PNG is damaged", f"{len(body)} bytes are no picture")
    return np.asarray(image, dtype=np.uint8)
