"""What the sky's commands read: pictures of a ceiling with its camera, pictures of a board."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from calibration.sky.board import Board
from groundstation.cli.progress import with_progress
from groundstation.data_sets.star_folder import find_frames, load_sky, read_frame
from groundstation.declarations.errors import UsageError
from groundstation.files.errors import FileError
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import Spots, detect
from groundstation.star_tracking.star_catalogue import StarCatalogue


@dataclass(frozen=True, slots=True, eq=False)
class SkyPictures:
    """Pictures of a known ceiling.

    Attributes:
        camera: Of the folder.
        catalogue: Of the folder.
        pictures: Spots of each picture.
        files: All that was read.
    """

    camera: CameraCalibration
    catalogue: StarCatalogue
    pictures: Sequence[Spots]
    files: Sequence[Path]


def read_sky_pictures(folder: Path) -> SkyPictures:
    """Read camera.json, ceiling.csv and the pictures of a folder.

    Raises:
        FileError: One of them is missing or wrong.
    """
    camera, catalogue = load_sky(folder)
    frames = find_frames(folder)
    files = [folder / "camera.json", folder / "ceiling.csv", *frames]
    return SkyPictures(camera, catalogue, find_spots(frames, camera), files)


def find_spots(frames: Sequence[Path], camera: CameraCalibration) -> list[Spots]:
    """Find the stars of pictures.

    Raises:
        FileError: A picture cannot be used.
    """
    cv2.setNumThreads(1)
    return [detect(read_frame(path, camera)) for path in with_progress(frames, "finding stars")]


def same_size(frames: Sequence[Path]) -> Iterator[NDArray[np.uint8]]:
    """Read pictures one after the other; the first decides their size.

    Raises:
        FileError: A picture cannot be used.
    """
    size = None
    for path in frames:
        image = read_frame(path, None)
        if size is not None and image.shape != size:
            raise FileError(f"{path}: is of another size than the pictures before it.")
        size = image.shape
        yield image


def printed_board(squares: str, square_mm: float, marker_mm: float, example: str) -> Board:
    """Return the board that options describe.

    Raises:
        UsageError: There is no such board.
    """
    columns, _, rows = squares.partition("x")
    if not (columns.isdecimal() and rows.isdecimal()):
        raise UsageError(f"--squares is '{squares}', expected columns x rows like {example}.")
    try:
        return Board(int(columns), int(rows), 1e-3 * square_mm, 1e-3 * marker_mm)
    except ValueError as error:
        raise UsageError(f"{error}.") from error
