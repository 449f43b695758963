"""Robust statistics of small samples."""

import numpy as np
from numpy.typing import NDArray


def middle_value(values: NDArray[np.floating]) -> float:
    """Give the upper median: without the averaging of ``np.median``, which costs ten times as much here."""
    half = values.size // 2
    return float(np.partition(values.ravel(), half)[half])
