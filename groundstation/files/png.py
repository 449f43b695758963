"""Pictures and figures as PNG; OpenCV or matplotlib loads only when it is needed."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from groundstation.files.writing import write_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DPI = 110


def new_figure(width_in: float, height_in: float) -> Figure:
    """Return an empty figure of a size in inches."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width_in, height_in), layout="constrained")


def write_png(path: Path, what: Figure | NDArray[np.uint8]) -> None:
    """Write a figure, or a picture (h, w) or (h, w, 3) in blue-green-red, whole or not at all.

    Raises:
        FileError: The file cannot be written.
    """
    write_file(path, png_of(what))


def png_of(what: Figure | NDArray[np.uint8]) -> bytes:
    """Return a figure or a picture as the bytes of a PNG."""
    if isinstance(what, np.ndarray):
        import cv2

        _, data = cv2.imencode(".png", what)
        return data.tobytes()
    memory = io.BytesIO()
    what.savefig(memory, format="png", dpi=DPI)
    return memory.getvalue()
