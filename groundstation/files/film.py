"""Films: written beside their place, read back, and only then put there.

OpenCV writes them, prints complaints of its own, and does not say where a disk took no more.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from groundstation.files.errors import FileError
from groundstation.files.foreign_lines import ForeignLines

if TYPE_CHECKING:  # pragma: no cover - cv2 takes a third of a second that most commands do not need
    import cv2

Picture = NDArray[np.uint8]

CODECS: Final = {".mp4": ("vp09", "mp4v"), ".avi": ("MJPG",)}
"""By the ending of the file, the best first: browsers show vp09, every OpenCV writes MJPG."""
_FULL_BYTES = 65536
"""Left on a disk that is full: less than one picture."""


class FilmFile:
    """A film in the making.

    Attributes:
        codec: Four letters.
        count: Pictures so far.

    Args:
        writer: Of OpenCV.
        codec: Its codec.
        lines: Hold back what it prints.
    """

    def __init__(self, writer: cv2.VideoWriter, codec: str, lines: ForeignLines) -> None:
        self.codec = codec
        self.count = 0
        self._writer, self._lines = writer, lines

    def write(self, picture: Picture) -> None:
        """Add a picture (height, width, 3), of the size of the film."""
        with self._lines.held():
            self._writer.write(picture)
        self.count += 1


def check_film_name(path: Path, what: str = "a film") -> None:
    """Refuse a name that no film of ours has.

    Raises:
        FileError: The ending is none of `CODECS`.
    """
    if path.suffix.lower() not in CODECS:
        raise FileError(f"{what} ends in {' or '.join(CODECS)}, found {path.name!r}.")


@contextmanager
def new_film(path: Path, rate_hz: float, size: tuple[int, int]) -> Iterator[FilmFile]:
    """Make a film; it takes its place when all of its pictures are in it.

    Args:
        path: Of the film, with an ending of `CODECS`.
        rate_hz: Of its pictures.
        size: Width and height, px.

    Raises:
        FileError: It cannot be written, or OpenCV has no codec here for such a file; what was there stays.
    """
    try:
        made = tempfile.TemporaryDirectory(dir=path.parent, prefix=".part.")
    except OSError as error:
        raise FileError(f"{path}: cannot be written ({error.strerror or error}).") from error
    with made as folder, ForeignLines() as lines:
        part = Path(folder) / path.name
        with lines.held():
            writer, codec = _opened(part, rate_hz, size)
        film = FilmFile(writer, codec, lines)
        try:
            yield film
        finally:
            with lines.held():
                writer.release()
        with lines.held():
            is_whole = _pictures_in(part) == film.count
        if not is_whole:
            why = "the disk is full" if _is_full(path.parent) else "not all of its pictures could be written"
            raise FileError(f"{path}: cannot be written ({why}).")
        try:
            part.replace(path)
        except OSError as error:
            raise FileError(f"{path}: cannot be written ({error.strerror or error}).") from error


def _opened(part: Path, rate_hz: float, size: tuple[int, int]) -> tuple[cv2.VideoWriter, str]:
    """A writer with the first codec that works here."""
    import cv2

    for codec in CODECS[part.suffix.lower()]:
        writer = cv2.VideoWriter(str(part), cv2.VideoWriter.fourcc(*codec), rate_hz, size)
        if writer.isOpened():
            return writer, codec
        writer.release()
    raise FileError(f"OpenCV here writes no {part.suffix} film: try {' or '.join(CODECS)}")


def _pictures_in(path: Path) -> int:
    """How many can be read: the count in the file's head says what was wanted."""
    import cv2

    film, count = cv2.VideoCapture(str(path)), 0
    while film.isOpened() and film.grab():
        count += 1
    film.release()
    return count


def _is_full(folder: Path) -> bool:
    """Whether its disk has no place left, apart from what this process is about to take away again."""
    found = os.statvfs(folder)
    return found.f_bavail * found.f_frsize < _FULL_BYTES
