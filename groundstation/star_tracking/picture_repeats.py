"""Pictures that a camera delivers twice: frozen, in a loop, or torn between two pictures.

Noise never repeats: two pictures of one scene differ in nearly every row that holds light. What is equal byte
for byte was not taken twice, it was delivered twice, and a fix made of it would carry a false stamp.
"""

from __future__ import annotations

import itertools
import zlib
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

REMEMBERED = 64
"""Pictures; a loop of more is not noticed."""
BANDS = 16
"""Of rows, compared one by one: a tear is noticed where a whole one repeats."""
LIGHT_DN = 8
"""Above the background: less may be the same in every picture of a camera that clips its noise."""
FULL_DN = 255
"""A pixel that is always full, a hot one, proves nothing."""
FEWEST_PIXELS = 8
"""So many lit pixels do not have the same noise twice."""

Bytes = NDArray[np.uint8]


class PictureRepeats:
    """The check sums of the pictures lately delivered by one camera."""

    __slots__ = ("_next", "_stamps_ns", "_sums")

    def __init__(self) -> None:
        self._sums = np.zeros((0, BANDS), np.uint32)
        self._stamps_ns: list[int] = []
        self._next = 0

    def complaint_about(self, picture: Bytes, stamp_ns: int) -> str:
        """Return why a picture is none of its moment, or nothing; it is remembered unless it is a repetition.

        Args:
            picture: Shape (rows, ...), contiguous: grey or colour.
            stamp_ns: Of the picture; those of one camera in their order.
        """
        edges = [len(picture) * band // BANDS for band in range(BANDS + 1)]
        bands = [picture[start:stop] for start, stop in itertools.pairwise(edges)]
        sums = np.array([zlib.crc32(band.data) for band in bands], np.uint32)
        equal = self._sums == sums
        whole = np.flatnonzero(equal.all(axis=1))
        again = [int(band) for band in np.flatnonzero(equal.any(axis=0))]
        lit = list(_lit(picture, bands, again))
        if len(whole) and lit:
            age_s = (stamp_ns - max(self._stamps_ns[row] for row in whole)) * 1e-9
            return f"frozen picture: it repeats the one of {age_s:.2f} s before byte for byte"
        if not len(whole):
            self._remember(sums, stamp_ns)
        if lit:
            first, last = edges[lit[0]], edges[lit[-1] + 1] - 1
            return f"torn picture: of rows {first} to {last} some are those of a picture before"
        return ""

    def _remember(self, sums: NDArray[np.uint32], stamp_ns: int) -> None:
        if len(self._stamps_ns) < REMEMBERED:
            self._sums = np.vstack((self._sums, sums))
            self._stamps_ns.append(stamp_ns)
            return
        self._sums[self._next], self._stamps_ns[self._next] = sums, stamp_ns
        self._next = (self._next + 1) % REMEMBERED


def _lit(picture: Bytes, bands: list[Bytes], chosen: list[int]) -> Iterator[int]:
    """Those of the chosen bands that hold light."""
    if not chosen:
        return
    background_dn = int(np.median(picture[::8, ::8]))
    for index in chosen:
        above = (bands[index] > background_dn + LIGHT_DN) & (bands[index] < FULL_DN)
        if np.count_nonzero(above) >= FEWEST_PIXELS:
            yield index
