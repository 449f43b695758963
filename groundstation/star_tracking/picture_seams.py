"""Seams of a picture: straight steps of its brightness, one pixel wide, along half of its width or height.

A lens blurs every edge of the world over some pixels, and none is parallel to the rows for hundreds of them.
What lost bytes is put together from stripes that stand elsewhere, and a JPEG that goes on after a wrong byte
is brighter or darker from there on: both leave a seam, even where no star tells that the rest is displaced.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from groundstation.core.library import default_core

MOST_DN = 8
"""A step counts for no more: a star is no seam."""
LEAST_DN = 2.0
"""Good pictures stay below 0.8; JPEGs have steps from block to block, of quality 50 below 1.5; of quality 30
one in a hundred is beyond."""
SCATTERS = 8.0
"""Beyond what the noise of a picture makes of it."""
OWN_AFTER = 30
"""What is at one place in so many pictures in a row is the camera's own: halves read out apart, a border."""


class PictureSeams:
    """Looks for seams in pictures of one camera, one thread at a time.

    Raises:
        CoreError: There is no compiled core.
    """

    def __init__(self) -> None:
        core = default_core()
        self._ffi, self._lib = core.ffi, core.lib
        self._shape = (0, 0)
        self._down = self._across = np.zeros((0, 0), np.int32)
        self._in_a_row: NDArray[np.int32] = np.zeros(0, np.int32)

    def find(self, picture: NDArray[np.uint8]) -> str:
        """Say where a picture has a seam; empty if it has none, or none but the camera's own.

        Args:
            picture: Shape (rows, columns), grey, pixels of a row side by side, at least 32 x 32.
        """
        rows, columns = picture.shape
        if picture.shape != self._shape:
            self._shape = picture.shape
            self._down = np.zeros((rows - 1, 2), np.int32)
            self._across = np.zeros((2, columns - 1), np.int32)
            self._in_a_row = np.zeros(2 * (rows + columns - 2), np.int32)
        down, across = self._down, self._across
        pointer = self._ffi.cast
        self._lib.gs_seams(
            pointer("uint8_t *", picture.ctypes.data),
            picture.strides[0],
            rows,
            columns,
            MOST_DN,
            pointer("int32_t *", down.ctypes.data),
            pointer("int32_t *", across.ctypes.data),
        )
        steps = (_seams_dn(down.T / (columns / 2)), _seams_dn(across / (rows / 2)))
        found = np.concatenate([each.ravel() for each in steps])
        spread = 1.4826 * np.median(np.abs(found - np.median(found)))
        are_seams = found > max(LEAST_DN, SCATTERS * float(spread))
        if not are_seams.any():
            self._in_a_row[:] = 0
            return ""
        self._in_a_row = np.where(are_seams, self._in_a_row + 1, 0)
        found[self._in_a_row > OWN_AFTER] = 0.0
        worst = int(np.argmax(found))
        if not found[worst] or not are_seams[worst]:
            return ""
        sums = steps[0].size
        what, place = (
            ("row", worst % (rows - 1)) if worst < sums else ("column", (worst - sums) % (columns - 1))
        )
        return f"its brightness steps by {found[worst]:.1f} from {what} {place} to the next, in half of it"


def _seams_dn(steps_dn: NDArray[np.float64]) -> NDArray[np.float64]:
    """By how much each step is larger than those beside it together: an edge that a lens saw is no seam.

    Args:
        steps_dn: Shape (2, n), of both halves.
    """
    size = np.abs(np.pad(steps_dn, ((0, 0), (1, 1))))
    seams: NDArray[np.float64] = size[:, 1:-1] - size[:, :-2] - size[:, 2:]
    return seams
