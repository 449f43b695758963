"""Files of the star-tracker commands: frames in, tables out; every refusal is one sentence."""

import csv
import errno
import math
import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track

from calibration.sky.survey.surveyed_sky import Anchor
from groundstation.cli.errors import UsageError
from groundstation.overhead.overhead_camera import OverheadCamera
from groundstation.star_tracking.camera_model import CameraCalibration

_ENDINGS = {".png": b"IEND\xaeB`\x82", ".jpg": b"\xff\xd9", ".jpeg": b"\xff\xd9"}
_SUFFIXES = frozenset({*_ENDINGS, ".bmp", ".pgm", ".tif", ".tiff"})


def find_frames(folder: Path, sub_folder: str = "frames") -> list[Path]:
    """Give the pictures of a data set in the order of their names.

    Raises:
        UsageError: There is no such folder, or no picture in it.
    """
    frames = folder / sub_folder
    if not frames.is_dir():
        raise UsageError(f"{frames}: no such folder; expected the pictures there.")
    found = sorted(p for p in frames.iterdir() if p.suffix.lower() in _SUFFIXES and p.is_file())
    if not found:
        raise UsageError(f"{frames}: holds no picture ({', '.join(sorted(_SUFFIXES))}).")
    return found


def read_frame(
    path: Path, camera: CameraCalibration | OverheadCamera | None, *, is_colour: bool | None = False
) -> NDArray[np.uint8]:
    """Read one 8-bit picture of the camera's size; of any size without a camera.

    Args:
        path: The file.
        camera: Whose size it must have.
        is_colour: Whether it must be in blue-green-red, (h, w, 3), instead of grey, (h, w); None: either.

    Raises:
        UsageError: The file is empty, torn, no picture, in colour or not, not 8 bit, or of another size.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise UsageError(f"{path}: cannot be read ({error.strerror or error}).") from error
    if not data:
        raise UsageError(f"{path}: is an empty file.")
    ending = _ENDINGS.get(path.suffix.lower())
    if ending is not None and ending not in data[-64:]:
        raise UsageError(f"{path}: is cut short, its end marker is missing.")
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise UsageError(f"{path}: is no picture that can be decoded.")
    if is_colour and (image.ndim != 3 or image.shape[2] != 3):
        raise UsageError(f"{path}: is a grey picture or has transparency, expected one in colour.")
    if is_colour is False and image.ndim != 2:
        raise UsageError(f"{path}: has {image.shape[2]} colour channels, expected a grey picture.")
    if image.dtype != np.uint8:
        raise UsageError(f"{path}: has {8 * image.dtype.itemsize}-bit pixels, expected 8 bit.")
    if camera is not None and image.shape[:2] != (camera.height, camera.width):
        raise UsageError(
            f"{path}: is {image.shape[1]} x {image.shape[0]} px, camera.json says "
            f"{camera.width} x {camera.height}."
        )
    return np.asarray(image, dtype=np.uint8)


def with_progress(frames: list[Path], what: str) -> Iterator[Path]:
    """Iterate with a progress bar on a terminal's stderr, silently elsewhere."""
    console = Console(stderr=True)
    yield from track(
        frames, description=what, console=console, disable=not console.is_terminal, transient=True
    )


def read_anchors(path: Path, frames: Sequence[str]) -> list[Anchor]:
    """Read anchors.csv: ``id,x_m,y_m,frame,u,v``; ``frames`` are the stems of the pictures in order.

    Raises:
        UsageError: The file is missing, a column is, or a value is no number or no frame.
    """
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise UsageError(f"{path}: cannot be read ({getattr(error, 'strerror', None) or error}).") from error
    number = {stem: i for i, stem in enumerate(frames)}
    anchors = []
    for line, row in enumerate(rows, start=2):
        for column in ("id", "x_m", "y_m", "frame", "u", "v"):
            if row.get(column) is None:
                raise UsageError(f"{path}: line {line}, column '{column}' is missing.")
        if row["frame"] not in number:
            raise UsageError(f"{path}: line {line}, there is no picture '{row['frame']}'.")
        values = []
        for column in ("x_m", "y_m", "u", "v"):
            try:
                value = float(row[column])
            except ValueError:
                value = math.nan
            if not math.isfinite(value):
                raise UsageError(f"{path}: line {line}, {column} is '{row[column]}', expected a number.")
            values.append(value)
        anchors.append(Anchor(row["id"], values[0], values[1], number[row["frame"]], values[2], values[3]))
    if len(anchors) < 2:
        raise UsageError(f"{path}: holds {len(anchors)} anchors, a survey needs at least two.")
    if len({anchor.name for anchor in anchors}) < len(anchors):
        raise UsageError(f"{path}: an anchor's id appears twice.")
    return anchors


@contextmanager
def whole_folder(path: Path) -> Iterator[Path]:
    """Give an empty folder whose files come to ``path`` when all has gone well, and nowhere otherwise.

    Files that are there already stay, unless they have the name of a new one.

    Raises:
        UsageError: The folder cannot be made, or a file is in its place.
    """
    try:
        if path.exists() and not path.is_dir():
            raise FileExistsError(errno.EEXIST, "a file is in its place")
        made = tempfile.TemporaryDirectory(dir=path.parent, prefix=f".{path.name}.")
    except OSError as error:
        raise UsageError(f"{path}: no such folder can be made ({error.strerror or error}).") from error
    with made as unfinished:
        yield Path(unfinished)
        path.mkdir(exist_ok=True)
        for file in sorted(Path(unfinished).iterdir()):
            file.replace(path / file.name)


def write_picture(path: Path, image: NDArray[np.uint8]) -> None:
    """Write a picture as PNG, whole or not at all.

    Raises:
        UsageError: The file cannot be written.
    """
    _, data = cv2.imencode(".png", image)
    _write(path, data.tobytes())


def check_targets(*paths: Path | None) -> None:
    """Refuse targets that cannot be written before any work is done.

    Raises:
        UsageError: A folder does not exist, or a target is one.
    """
    for path in paths:
        if path is None:
            continue
        if not path.parent.is_dir():
            raise UsageError(f"{path}: cannot be written, there is no folder {path.parent}.")
        if path.is_dir():
            raise UsageError(f"{path}: cannot be written, it is a folder.")


def write_atomically(path: Path, text: str) -> None:
    """Write a text file whole or not at all.

    Raises:
        UsageError: The folder does not exist or cannot be written.
    """
    _write(path, text.encode())


def _write(path: Path, data: bytes) -> None:
    try:
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=".part")
    except OSError as error:
        raise UsageError(f"{path}: cannot be written ({error.strerror or error}).") from error
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        Path(temporary).chmod(0o644)
        Path(temporary).replace(path)
    except OSError as error:
        Path(temporary).unlink(missing_ok=True)
        raise UsageError(f"{path}: cannot be written ({error.strerror or error}).") from error
