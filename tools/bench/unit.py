"""The reference unit: a fixed piece of work, so that figures of two machines can be compared."""

import time

import numpy as np

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
