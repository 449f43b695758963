"""Straight steps of a picture's brightness in NumPy: what the core's sums must agree with."""

import numpy as np
from numpy.typing import NDArray


def sum_steps(picture: NDArray[np.uint8], most_dn: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Sums of bounded steps per half: from row to row (n - 1, 2), from column to column (2, m - 1)."""
    rows, columns = picture.shape
    values = picture.astype(np.int64)
    down = np.clip(np.diff(values, axis=0), -most_dn, most_dn)
    across = np.clip(np.diff(values, axis=1), -most_dn, most_dn)
    by_half = [down[:, : columns // 2].sum(axis=1), down[:, columns // 2 :].sum(axis=1)]
    return np.stack(by_half, axis=1), np.stack(
        [across[: rows // 2].sum(axis=0), across[rows // 2 :].sum(axis=0)]
    )
