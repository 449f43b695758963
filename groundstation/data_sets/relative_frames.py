"""Frames of a relative-navigation data set in one file: ``frames`` (n, h, w), 8 bit, in a NumPy archive."""

from __future__ import annotations

import io
import zipfile
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from groundstation.files.errors import FileError
from groundstation.files.reading import read_bytes

KEY = "frames"
MOST_BYTES = 4_000_000_000
"""Of all frames together."""
_HINT = f"store frames by numpy.savez(..., {KEY}={KEY})"


def read_frames(path: Path) -> NDArray[np.uint8]:
    """Return the frames, (n, h, w) or in colour (n, h, w, 3).

    Raises:
        FileError: The file is missing or no archive of NumPy, or what it holds is no frames.
    """
    data = read_bytes(path)
    if data.startswith(np.lib.format.MAGIC_PREFIX):
        raise FileError(f"{path}: is a single array (.npy) and no .npz: {_HINT}.")
    if not zipfile.is_zipfile(io.BytesIO(data)):
        raise FileError(f"{path}: is no .npz: {_HINT}.")
    frames = _frames(data, path)
    if frames.dtype != np.uint8:
        raise FileError(f"{path}: {KEY} holds {frames.dtype}, expected 8-bit pixels (uint8).")
    if frames.ndim not in (3, 4) or (frames.ndim == 4 and frames.shape[3] != 3):
        raise FileError(
            f"{path}: {KEY} has the shape {frames.shape}, expected (frames, rows, columns) or the same with "
            "three colours."
        )
    if min(frames.shape[:3]) < 1 or min(frames.shape[1:3]) < 8:
        raise FileError(f"{path}: {KEY} has the shape {frames.shape}: there is no picture in it.")
    return np.asarray(frames, dtype=np.uint8)


_SPOILT = (ValueError, OSError, EOFError, zipfile.BadZipFile, zlib.error, NotImplementedError)
"""What NumPy and zipfile raise on data that are spoilt; the last where a compression is unknown to them."""


def _frames(data: bytes, path: Path) -> NDArray[np.generic]:
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            names: list[str] = archive.files
            frames: NDArray[np.generic] | None = archive[KEY] if KEY in names else None
    except _SPOILT as error:  # an archive of anybody: each is a spoilt one, of a kind of its own
        raise FileError(f"{path}: is a damaged .npz, or holds objects: {_HINT}.") from error
    if frames is None:
        raise FileError(f"{path}: holds no array '{KEY}' ({', '.join(names) or 'nothing'}): {_HINT}.")
    return frames
