"""The published rule for long antennas: the far ends of the longest outline are two of the points.

Ivanov, Karpenko, Ovchinnikov 2012, section 3: in the film of the Chibis-M two long antennas form one outline;
its least and largest point along image x are their tips. For a craft that rolls, the ends along the outline's
own longest direction are ours.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.outlines import Blob

Floats = NDArray[np.float64]

END_PX = 1.5
"""Boundary pixels within this of the extreme one make up a tip."""
TIP_SIGMA_PX = 0.6
"""Along an antenna its end lies anywhere in the last pixel, and its light fades there."""


def longest(blobs: Sequence[Blob]) -> int | None:
    """Return the number of the blob with the longest outline; None without blobs."""
    if not blobs:
        return None
    return int(np.argmax([len(blob.outline) for blob in blobs]))


def tips_along_x(blob: Blob) -> Floats:
    """Return the published tips (2, 2): ends of an outline along image x, the left one first."""
    return _ends(blob, np.array((1.0, 0.0)))


def tips_along_itself(blob: Blob) -> Floats:
    """Return the ends (2, 2) of an outline along its longest direction, the left one first."""
    spread = blob.outline - blob.outline.mean(axis=0)
    direction = np.linalg.svd(spread.astype(np.float64), full_matrices=False)[2][0]
    return _ends(blob, direction if direction[0] >= 0.0 else -direction)


def tip_covariances() -> Floats:
    """Covariances (2, 2, 2) of two tips, px^2."""
    return np.broadcast_to(TIP_SIGMA_PX**2 * np.eye(2), (2, 2, 2)).copy()


def _ends(blob: Blob, direction: Floats) -> Floats:
    along = blob.outline @ direction
    low, high = float(along.min()), float(along.max())
    return np.stack(
        (
            blob.outline[along <= low + END_PX].mean(axis=0),
            blob.outline[along >= high - END_PX].mean(axis=0),
        )
    )
