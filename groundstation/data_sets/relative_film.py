"""Pictures of a target in order of time: a video file, FRAMES.npz, or a folder of pictures.

A film that ends in a broken frame, or whose frames change size, is read to its end: what cannot be used is
given as a trouble in the place of a picture. A picture that repeats the one before byte for byte was not
taken at its time: noise never repeats.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.data_sets.relative_frames import read_frames
from groundstation.data_sets.star_folder import read_frame
from groundstation.files.errors import FileError
from groundstation.files.foreign_lines import ForeignLines
from groundstation.relative_navigation.pinhole import PinholeCamera
from groundstation.relative_navigation.spots import Trouble

Picture = NDArray[np.uint8]

PICTURES = frozenset({".png", ".jpg", ".jpeg", ".bmp", ".pgm", ".tif", ".tiff"})
DEFAULT_RATE_HZ = 30.0
_MOST_RATE_HZ = 10_000.0
_LIGHT_DN = 8
"""Between darkest and brightest: pictures with less may be alike, there is nothing in them."""


@dataclass(frozen=True, slots=True, eq=False)
class Shot:
    """One frame of a film.

    Attributes:
        number: From 0.
        t_s: From the first frame.
        picture: Grey (h, w) or blue-green-red (h, w, 3); None where it cannot be used.
        trouble: Why not.
    """

    number: int
    t_s: float
    picture: Picture | None
    trouble: Trouble


class Film:
    """A film for one camera.

    Args:
        path: Video file, ``.npz`` or folder.
        camera: Whose size frames must have.
        rate_hz: Frames a second; None: the file's own, else 30.

    Attributes:
        count: Frames that the file names; 0 where it does not tell.
        rate_hz: Frames a second.
        broken_from: The first frame that cannot be read, as far as `shots` has come.
        unreadable: How many cannot.
        complaints: At how many the decoder printed something: they may be damaged.

    Raises:
        FileError: There is no such film, it holds no frame, or its first frame has another size.
    """

    def __init__(self, path: Path, camera: PinholeCamera, rate_hz: float | None = None) -> None:
        self._path, self._camera = path, camera
        self._video, self._stack, self._files = None, None, None
        own = DEFAULT_RATE_HZ
        if path.is_dir():
            self._files = sorted(p for p in path.iterdir() if p.suffix.lower() in PICTURES)
            self.count = len(self._files)
            size = None if not self._files else read_frame(self._files[0], None, is_colour=None).shape[:2]
        elif path.suffix.lower() == ".npz":
            self._stack = read_frames(path)
            self.count, size = len(self._stack), self._stack.shape[1:3]
        else:
            self._video = _opened(path)
            own = float(self._video.get(cv2.CAP_PROP_FPS))
            own = own if 0.0 < own <= _MOST_RATE_HZ and math.isfinite(own) else DEFAULT_RATE_HZ
            self.count = max(0, int(self._video.get(cv2.CAP_PROP_FRAME_COUNT)))
            size = (
                int(self._video.get(cv2.CAP_PROP_FRAME_HEIGHT)),
                int(self._video.get(cv2.CAP_PROP_FRAME_WIDTH)),
            )
        if size is None or (self.count == 0 and self._video is None):
            raise FileError(f"{path}: holds no picture.")
        if size != (camera.height_px, camera.width_px):
            raise FileError(
                f"{path}: frames are {size[1]} x {size[0]} px, the camera of the target file has "
                f"{camera.width_px} x {camera.height_px}."
            )
        self.rate_hz = own if rate_hz is None else rate_hz
        self.broken_from: int | None = None
        self.unreadable = self.complaints = 0

    def shots(self) -> Iterator[Shot]:
        """Every frame, in order; once."""
        number = 0
        before: Picture | None = None
        for picture in self._pictures():
            trouble = Trouble.NONE
            if picture is None:
                trouble = Trouble.BROKEN
            elif picture.shape[:2] != (self._camera.height_px, self._camera.width_px):
                picture, trouble = None, Trouble.WRONG_SIZE
            elif before is not None and np.array_equal(picture, before) and int(np.ptp(picture)) > _LIGHT_DN:
                picture, trouble = None, Trouble.FROZEN
            else:
                before = picture
            if trouble is Trouble.BROKEN and self.broken_from is None:
                self.broken_from = number
            yield Shot(number, number / self.rate_hz, picture, trouble)
            number += 1
        if number == 0:
            raise FileError(f"{self._path}: holds no frame that can be decoded.")

    def _pictures(self) -> Iterator[Picture | None]:
        if self._stack is not None:
            yield from self._stack
            return
        if self._files is not None:
            for file in self._files:
                try:
                    yield read_frame(file, None, is_colour=None)
                except FileError:
                    self.unreadable += 1
                    yield None
            return
        assert self._video is not None
        read = 0
        with ForeignLines() as lines:
            while True:
                with lines.held():
                    there, picture = self._video.read()
                self.complaints += lines.were_there()
                if not there:
                    break
                read += 1
                yield np.asarray(picture, dtype=np.uint8)
            with lines.held():
                self._video.release()
        if read < self.count:
            self.unreadable = self.count - read
            yield None  # the container names frames that its decoder does not give


def _opened(path: Path) -> cv2.VideoCapture:
    if not path.exists():
        raise FileError(f"{path}: no such file.")
    if not path.is_file() or path.stat().st_size == 0:
        raise FileError(f"{path}: is an empty file." if path.is_file() else f"{path}: is no file.")
    with ForeignLines() as lines, lines.held():
        video = cv2.VideoCapture(str(path))
    if not video.isOpened():
        raise FileError(f"{path}: is no video that can be decoded.")
    return video
