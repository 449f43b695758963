"""What bad links and busy hosts do to pictures: JPEGs whose bytes suffered, raw pictures whose rows did."""

import re
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]
OfJpeg = Callable[[np.random.Generator, bytes, bytes], bytes]
OfRaw = Callable[[np.random.Generator, Image, Image], Image]

_HEAD = 650  # bytes of a JPEG's tables; without them no decoder begins


def _lost(rng: np.random.Generator, whole: bytes, _: bytes) -> bytes:
    at, count = _stretch(rng, whole)
    return whole[:at] + whole[at + count :]


def _flipped(rng: np.random.Generator, whole: bytes, _: bytes) -> bytes:
    bad = bytearray(whole)
    for at in rng.integers(_HEAD, len(bad) - 2, rng.integers(1, 20)):
        bad[at] ^= int(rng.integers(1, 256))
    return bytes(bad)


def _cut(rng: np.random.Generator, whole: bytes, _: bytes) -> bytes:
    end = b"\xff\xd9" if rng.random() < 0.5 else b""
    return whole[: rng.integers(_HEAD, len(whole) - 2)] + end


def _zeros(rng: np.random.Generator, whole: bytes, _: bytes) -> bytes:
    at, count = _stretch(rng, whole)
    return whole[:at] + bytes(count) + whole[at + count :]


def _spliced(rng: np.random.Generator, whole: bytes, before: bytes) -> bytes:
    at = rng.integers(_HEAD, min(len(whole), len(before)) - 2)
    return before[:at] + whole[at:]


def _intervals_lost(rng: np.random.Generator, whole: bytes, before: bytes) -> bytes:
    restarts = [found.start() for found in re.finditer(rb"\xff[\xd0-\xd7]", whole)]
    if len(restarts) < 12:
        return _lost(rng, whole, before)
    first = rng.integers(len(restarts) - 9)
    return whole[: restarts[first]] + whole[restarts[first + rng.choice([1, 2, 3, 8])] :]


def _stretch(rng: np.random.Generator, whole: bytes) -> tuple[int, int]:
    count = int(rng.integers(1, 2000))
    return int(rng.integers(_HEAD, len(whole) - count - 2)), count


def _rolled(rng: np.random.Generator, image: Image, _: Image) -> Image:
    row = rng.integers(20, len(image) - 20)
    return np.vstack((image[:row], np.roll(image[row:], rng.integers(2, image.shape[1] - 2), axis=1)))


def _bytes_lost(rng: np.random.Generator, image: Image, before: Image) -> Image:
    flat, count = image.ravel(), int(rng.integers(1, 4000))
    at = rng.integers(20 * image.shape[1], flat.size - 20 * image.shape[1])
    return np.concatenate((flat[:at], flat[at + count :], before.ravel()[:count])).reshape(image.shape)


def _rows_twice(rng: np.random.Generator, image: Image, _: Image) -> Image:
    row, count = rng.integers(20, len(image) - 130), rng.integers(2, 120)
    return np.vstack((image[: row + count], image[row:]))[: len(image)]


def _rows_over(rng: np.random.Generator, image: Image, _: Image) -> Image:
    count = rng.integers(16, 160)
    row = rng.integers(0, len(image) - 2 * count + 1)
    torn = image.copy()
    torn[row + count : row + 2 * count] = image[row : row + count]
    return torn


def _upper_of_before(rng: np.random.Generator, image: Image, before: Image) -> Image:
    row = rng.integers(20, len(image) - 20)
    return np.vstack((before[:row], image[row:]))


def _upper_half_of_before(_: np.random.Generator, image: Image, before: Image) -> Image:
    return np.vstack((before[: len(image) // 2], image[len(image) // 2 :]))


JPEG: Mapping[str, OfJpeg] = {
    "bytes lost": _lost,
    "bytes flipped": _flipped,
    "cut": _cut,
    "zeros inside": _zeros,
    "two spliced": _spliced,
    "restart intervals lost": _intervals_lost,
}
RAW: Mapping[str, OfRaw] = {
    "lower part rolled": _rolled,
    "bytes lost": _bytes_lost,
    "rows twice": _rows_twice,
    "rows over others": _rows_over,
    "upper part of the one before": _upper_of_before,
    "upper half of the one before": _upper_half_of_before,
}
