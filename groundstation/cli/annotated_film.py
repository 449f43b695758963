"""The film that shows what was found: written beside its place, looked at, and only then put there."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.declarations.errors import UsageError
from groundstation.files.errors import FileError
from groundstation.files.foreign_lines import ForeignLines

Picture = NDArray[np.uint8]

CODECS = {".avi": "MJPG", ".mp4": "mp4v"}
"""Ending to codec of an annotated film."""
_FULL_BYTES = 65536
"""Left on a disk that is full: less than one picture."""


def check_annotated(path: Path | None) -> None:
    """Refuse a name that no film of ours has.

    Raises:
        UsageError: The ending is none of `CODECS`.
    """
    if path is not None and path.suffix.lower() not in CODECS:
        raise UsageError(f"--annotated must end in {' or '.join(CODECS)}, found {path.name!r}.")


@contextmanager
def annotated_film(
    path: Path | None, rate_hz: float, size: tuple[int, int]
) -> Iterator[Callable[[Picture], None]]:
    """Give what writes a frame; the film takes its place when all frames are in it, whole.

    Args:
        path: Of the film; None: nothing is written.
        rate_hz: Of its frames.
        size: Width and height.

    Raises:
        FileError: It cannot be written; what was there stays.
    """
    if path is None:
        yield lambda _picture: None
        return
    try:
        made = tempfile.TemporaryDirectory(dir=path.parent, prefix=".part.")
    except OSError as error:
        raise FileError(f"{path}: cannot be written ({error.strerror or error}).") from error
    with made as folder, ForeignLines() as lines:
        part = Path(folder) / path.name
        with lines.held():
            code = cv2.VideoWriter.fourcc(*CODECS[path.suffix.lower()])
            writer = cv2.VideoWriter(str(part), code, rate_hz, size)
        if not writer.isOpened():
            raise FileError(f"{path}: this installation of OpenCV cannot write such a film.")
        count = 0

        def write(picture: Picture) -> None:
            nonlocal count
            with lines.held():  # OpenCV tells nobody else that a frame was not written
                writer.write(picture)
            count += 1

        try:
            yield write
        finally:
            with lines.held():
                writer.release()
        with lines.held():
            is_whole = _frames_in(part) == count
        if not is_whole:
            why = "the disk is full" if _is_full(path.parent) else "not all of its frames could be written"
            raise FileError(f"{path}: cannot be written ({why}).")
        try:
            part.replace(path)
        except OSError as error:
            raise FileError(f"{path}: cannot be written ({error.strerror or error}).") from error


def _frames_in(path: Path) -> int:
    """How many frames can be read."""
    video, count = cv2.VideoCapture(str(path)), 0
    while video.isOpened() and video.read()[0]:
        count += 1
    video.release()
    return count


def _is_full(folder: Path) -> bool:
    """Whether its disk has no place left, apart from what this process is about to take away again."""
    found = os.statvfs(folder)
    return found.f_bavail * found.f_frsize < _FULL_BYTES
