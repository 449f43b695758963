"""Pictures of a board that lies on the table: its corners, and the tape's places."""

from __future__ import annotations

import math
from pathlib import Path

import cv2
import numpy as np

from calibration.overhead.camera_pose import BoardView
from calibration.sky.board import Board, find_corners
from groundstation.cli.progress import with_progress
from groundstation.data_sets.star_folder import find_frames, read_frame
from groundstation.files.errors import FileError
from groundstation.files.number_tables import load_table
from groundstation.files.reading import read_bytes
from groundstation.overhead.overhead_camera import OverheadCamera

_FARTHEST_M, _MOST_DEG = 100.0, 720.0
NO_POSE = {"position_table_m": [0.0, 0.0, 1.0], "yaw_rad": 0.0, "tilt_x_rad": 0.0, "tilt_y_rad": 0.0}
"""Stands in for the pose in a file that knows only the lens."""


def read_board_views(folder: Path, printed: Board) -> tuple[list[BoardView], OverheadCamera]:
    """Read camera.json (its lens), places.csv and the pictures that it names.

    Raises:
        FileError: One of them is missing or wrong, or shows no board.
    """
    path = folder / "camera.json"
    lens = OverheadCamera.parse(read_bytes(path), path, NO_POSE)
    frames = find_frames(folder)
    places = _read_places(folder / "places.csv", {path.stem for path in frames})
    views = []
    for path in with_progress([path for path in frames if path.stem in places], "finding corners"):
        image = read_frame(path, lens, is_colour=None)
        grey = image if image.ndim == 2 else np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), np.uint8)
        found = find_corners(grey, printed)
        if found is None:
            raise FileError(
                f"{path}: no ChArUco board of {printed.columns}x{printed.rows} squares is found "
                "(a marker must cover 20 pixels)."
            )
        board_m, pixel = (np.asarray(values, dtype=np.float64) for values in found)
        views.append(BoardView(board_m, pixel, *places[path.stem], path.stem))
    return views, lens


def _read_places(path: Path, frames: set[str]) -> dict[str, tuple[float, float, float]]:
    """Read places.csv: x, y (m) and heading (rad) by picture."""
    most = {"x_m": _FARTHEST_M, "y_m": _FARTHEST_M, "heading_deg": _MOST_DEG}
    table = load_table(path, tuple(most), ("frame",), unique=("frame",), most=most)
    places = {}
    for line, frame, (x_m, y_m, heading_deg) in zip(
        table.lines, table.words["frame"], table.numbers.tolist(), strict=True
    ):
        if frame not in frames:
            raise FileError(f"{path}: line {line}, frame: there is no picture '{frame}'.")
        places[frame] = (x_m, y_m, math.radians(heading_deg))
    return places
