"""The reference units: fixed pieces of work, so that figures of two machines can be compared."""

import time

import cv2
import numpy as np
from numpy.typing import NDArray

_REPEATS = 7
_PRODUCTS = 2000
_ADDITIONS = 200_000


def reference_unit_s() -> float:
    """CPU seconds of the unit (integer additions in Python, 24 x 24 products in NumPy): the best of seven."""
    matrix = np.linspace(-1.0, 1.0, 24 * 24).reshape(24, 24)
    best_s = float("inf")
    for _ in range(_REPEATS):
        begin_s = time.process_time()
        total = 0
        for i in range(_ADDITIONS):
            total += i & 7
        product = matrix
        for _ in range(_PRODUCTS):
            product = matrix @ product
            product /= np.abs(product).max()
        best_s = min(best_s, time.process_time() - begin_s)
    return best_s


def picture() -> NDArray[np.uint8]:
    """A picture (480, 640) of noise, for the small unit where no other picture is at hand."""
    return np.random.default_rng(0).integers(0, 256, (480, 640), dtype=np.uint8)


def blur_s(image: NDArray[np.uint8]) -> float:
    """CPU seconds of the small unit, one ``cv2.GaussianBlur`` 5x5: short enough to be taken between calls."""
    begin_s = time.process_time()
    cv2.GaussianBlur(image, (5, 5), 0)
    return time.process_time() - begin_s
