"""Pictures that a camera delivers twice: frozen, in a loop, torn between two pictures, or with rows twice.

Noise never repeats: two pictures of one scene differ in nearly every row that holds light. What is equal byte
for byte was not taken twice, it was delivered twice, and a fix made of it would carry a false stamp.
"""

from __future__ import annotations

import functools
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
NOISY_SHARE = 0.25
"""Of the pixels of a row that differ from their neighbours, from where it has its own noise: rows that a
camera clips, or a JPEG smooths, may be equal."""

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
        twice = _row_twice(picture)
        return f"torn picture: row {twice[1]} is row {twice[0]} again" if twice else ""

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


def _row_twice(picture: Bytes) -> tuple[int, int] | None:
    """Two rows with noise that are equal, byte for byte."""
    rows = picture.reshape(len(picture), -1)
    words = rows.shape[1] // 8
    if words == 0:
        return None
    packed = np.ascontiguousarray(rows[:, : 8 * words]).view(np.uint64)
    sums = packed @ _odd_numbers(words)  # modulo 2^64: what differs gets the same sum by chance once in 2^64
    order = np.argsort(sums, kind="stable")
    for index in np.flatnonzero(np.diff(sums[order]) == 0).tolist():
        first, second = sorted((int(order[index]), int(order[index + 1])))
        if (first, second) in ((0, 1), (len(rows) - 2, len(rows) - 1)):
            continue  # what makes colours of a mosaic copies the rows next to the border
        steps = np.diff(picture[first].astype(np.int16), axis=0)  # from pixel to pixel, of each colour
        is_noisy = np.count_nonzero(steps) > NOISY_SHARE * rows.shape[1]
        if is_noisy and np.array_equal(rows[first], rows[second]):
            return first, second
    return None


@functools.cache
def _odd_numbers(count: int) -> NDArray[np.uint64]:
    return np.random.default_rng(1).integers(0, 2**63, count, dtype=np.uint64) * 2 + 1
