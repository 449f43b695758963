"""Frames of a relative-navigation data set in one file: ``frames`` (n, h, w), 8 bit, in a NumPy archive."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from groundstation.files.errors import FileError
from groundstation.files.reading import read_bytes

KEY = "frames"
MOST_BYTES = 4_000_000_000
"""Of all frames together."""


def read_frames(path: Path) -> NDArray[np.uint8]:
    """Return the frames, (n, h, w) or in colour (n, h, w, 3).

    Raises:
        FileError: The file is missing or no archive of NumPy, or what it holds is no frames.
    """
    data = read_bytes(path)
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            names = list(getattr(archive, "files", []))
            if KEY not in names:
                held = ", ".join(names) or "a single array"
                raise FileError(f"{path}: holds no array '{KEY}' ({held}).")
            frames = archive[KEY]
    except (ValueError, OSError, EOFError, KeyError, zipfile.BadZipFile, AttributeError, TypeError) as error:
        raise FileError(f"{path}: is no NumPy archive of frames ({error}).") from error
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
