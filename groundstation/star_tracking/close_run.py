"""The longest run of mutually close places: what the published identification decides by."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def longest_run(place_m: Array, closeness_m: float) -> NDArray[np.int64]:
    """Return the largest set of places any two of which are close, along x and along y.

    Places are sorted by x; of each stretch of x that is not longer than the limit, its places are sorted by
    y, and the longest stretch of y is taken. Of sets of equal size the first in this order counts.

    Args:
        place_m: Shape (n, 2).
        closeness_m: Largest difference of two places of a run, in each coordinate.

    Returns:
        Rows of the places, shape (k,), ascending; empty for none.
    """
    by_x = np.argsort(place_m[:, 0], kind="stable")
    x_m, y_m = place_m[by_x, 0], place_m[by_x, 1]
    ends = np.searchsorted(x_m, x_m + closeness_m, side="right")
    best = np.zeros(0, dtype=np.int64)
    for start, end in enumerate(ends.tolist()):
        if end - start <= len(best):
            continue
        by_y = start + np.argsort(y_m[start:end], kind="stable")
        sorted_y_m = y_m[by_y]
        lengths = np.searchsorted(sorted_y_m, sorted_y_m + closeness_m, side="right") - np.arange(len(by_y))
        first = int(np.argmax(lengths))
        if lengths[first] > len(best):
            best = by_y[first : first + int(lengths[first])]
    return np.sort(by_x[best]).astype(np.int64)
