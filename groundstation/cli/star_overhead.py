"""Commands of the camera over the table: mock-ups found in its pictures, and where it hangs."""

import csv
import io
import json
import math
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
import typer

from calibration.overhead.pose import (
    POSE,
    BoardView,
    OverheadPose,
    calibrate_overhead_pose,
)
from calibration.result import CalibrationResult, Quantity, provenance_of
from calibration.sky.board import Board, find_corners
from calibration.sky.figures import draw_board_pose
from groundstation.cli.errors import UsageError
from groundstation.cli.star_files import (
    check_targets,
    find_frames,
    read_frame,
    with_progress,
    write_atomically,
)
from groundstation.cli.star_plots import save_figure
from groundstation.files.errors import FileError
from groundstation.overhead.liveries import load_liveries
from groundstation.overhead.overhead_camera import OverheadCamera
from groundstation.overhead.tracker import NoOverheadFix, OverheadFix, OverheadTracker

COLUMNS = (
    "frame",
    "vehicle",
    "fix",
    "x_m",
    "y_m",
    "heading_rad",
    "ms",
    "circles",
    "std_x_m",
    "std_y_m",
    "std_heading_rad",
    "misfit_m",
    "reason",
)
PLACES = ("frame", "x_m", "y_m", "heading_deg")


def overhead(
    folder: Annotated[Path, typer.Argument(help="With camera.json, mock_ups.toml and frames/ in colour.")],
    out: Annotated[Path, typer.Option(help="CSV to write, one row per frame and mock-up.")],
) -> None:
    """Find mock-ups in pictures taken from above.

    Each picture is looked at on its own.
    mock_ups.toml says which coloured circles each mock-up wears, camera.json is that of the camera over the
    table; ms is the CPU time of the whole picture.

    Example:
      groundstation star-tracker overhead recordings/table --out answers.csv
    """
    cv2.setNumThreads(1)
    check_targets(out)
    if not folder.is_dir():
        raise UsageError(f"{folder}: no such folder.")
    camera = OverheadCamera.load(folder / "camera.json")
    tracker = OverheadTracker(camera, load_liveries(folder / "mock_ups.toml"))
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(COLUMNS)
    for path in with_progress(find_frames(folder), "looking"):
        image = read_frame(path, camera, is_colour=True)
        begin = time.process_time()
        answers = tracker.look(image)
        ms = 1000.0 * (time.process_time() - begin)
        for answer in answers:
            writer.writerow(_row(path.stem, answer, ms))
    write_atomically(out, buffer.getvalue())


def _row(frame: str, answer: OverheadFix | NoOverheadFix, ms: float) -> list[str]:
    if isinstance(answer, NoOverheadFix):
        return [frame, answer.vehicle, "0", "", "", "", f"{ms:.3f}", "0", "", "", "", "", answer.reason]
    pose = (answer.x_m, answer.y_m, answer.heading_rad)
    std = np.sqrt(np.diag(answer.cov)).tolist()
    return [
        frame,
        answer.vehicle,
        "1",
        *(f"{value:.7f}" for value in pose),
        f"{ms:.3f}",
        str(answer.circles),
        *(f"{value:.3e}" for value in (*std, answer.misfit_m)),
        "",
    ]


def overhead_pose(
    folder: Annotated[Path, typer.Argument(help="With camera.json (its lens), places.csv and frames/.")],
    out: Annotated[Path, typer.Option(help="Result with provenance to write (TOML).")],
    camera_out: Annotated[Path | None, typer.Option(help="camera.json to write with the pose.")] = None,
    squares: Annotated[str, typer.Option(help="Squares of the ChArUco board, as 6x4.")] = "6x4",
    square_mm: Annotated[float, typer.Option(help="Edge of a square.", min=0.1)] = 150.0,
    marker_mm: Annotated[float, typer.Option(help="Edge of a marker.", min=0.1)] = 110.0,
    thickness_mm: Annotated[float, typer.Option(help="Of the board.", min=0.0)] = 0.0,
    plot: Annotated[Path | None, typer.Option(help="Residual plot to write (PNG).")] = None,
    tape_mm: Annotated[float, typer.Option(help="How well places were measured.", min=0.01)] = 2.0,
    tape_deg: Annotated[float, typer.Option(help="How well headings were.", min=1e-3)] = 0.2,
) -> None:
    """Find where the camera over the table hangs.

    The pictures show a ChArUco board that lies on the table.
    places.csv has the columns frame,x_m,y_m,heading_deg: where the print's upper left corner lies in the
    table's coordinates, and where its long edge points. One place is enough; several check the tape.

    Example:
      groundstation star-tracker overhead-pose recordings/board --out pose.toml --camera-out camera.json
    """
    check_targets(out, camera_out, plot)
    columns, _, rows = squares.partition("x")
    if not (columns.isdecimal() and rows.isdecimal()):
        raise UsageError(f"--squares is '{squares}', expected columns x rows like 6x4.")
    try:
        printed = Board(int(columns), int(rows), 1e-3 * square_mm, 1e-3 * marker_mm)
    except ValueError as error:
        raise UsageError(f"{error}.") from error
    lens = _lens(folder / "camera.json")
    frames = find_frames(folder)
    places = _read_places(folder / "places.csv", {path.stem for path in frames})
    views = []
    for path in with_progress([path for path in frames if path.stem in places], "finding corners"):
        image = read_frame(path, lens, is_colour=None)
        grey = image if image.ndim == 2 else np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), np.uint8)
        found = find_corners(grey, printed)
        if found is None:
            raise UsageError(
                f"{path}: no ChArUco board of {squares} squares is found (a marker must cover 20 pixels)."
            )
        board_m, pixel = (np.asarray(values, dtype=np.float64) for values in found)
        views.append(BoardView(board_m, pixel, *places[path.stem]))
    try:
        pose = calibrate_overhead_pose(
            views, lens, 1e-3 * tape_mm, math.radians(tape_deg), 1e-3 * thickness_mm
        )
    except ValueError as error:
        raise UsageError(f"{folder}: {error}.") from error
    write_atomically(out, _result(folder, pose, len(views)).to_toml())
    if camera_out is not None:
        write_atomically(camera_out, json.dumps(pose.camera.to_mapping(), indent=1) + "\n")
    if plot is not None:
        save_figure(draw_board_pose(pose.residual_px, pose.tape_m, pose.tape_rad), plot)
    print(_sentence(pose, len(views)))


def _lens(path: Path) -> OverheadCamera:
    """Read the camera's file; a pose that is not known yet may be left out."""
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        data = None
    if not isinstance(data, dict):
        return OverheadCamera.load(path)  # which says what is wrong
    unknown = {"position_table_m": [0.0, 0.0, 1.0], "yaw_rad": 0.0, "tilt_x_rad": 0.0, "tilt_y_rad": 0.0}
    try:
        return OverheadCamera.from_mapping({**unknown, **data})
    except ValueError as error:
        raise FileError(f"{path}: {error}.") from error


def _read_places(path: Path, frames: set[str]) -> dict[str, tuple[float, float, float]]:
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise UsageError(f"{path}: cannot be read ({getattr(error, 'strerror', None) or error}).") from error
    places = {}
    for line, row in enumerate(rows, start=2):
        for column in PLACES:
            if row.get(column) is None:
                raise UsageError(f"{path}: line {line}, column '{column}' is missing.")
        if row["frame"] not in frames:
            raise UsageError(f"{path}: line {line}, there is no picture '{row['frame']}'.")
        numbers = []
        for column in PLACES[1:]:
            try:
                value = float(row[column])
            except ValueError:
                value = math.nan
            if not math.isfinite(value):
                raise UsageError(f"{path}: line {line}, {column} is '{row[column]}', expected a number.")
            numbers.append(value)
        places[row["frame"]] = (numbers[0], numbers[1], math.radians(numbers[2]))
    if not places:
        raise UsageError(f"{path}: names no picture; expected rows of {','.join(PLACES)}.")
    return places


def _result(folder: Path, pose: OverheadPose, pictures: int) -> CalibrationResult:
    camera = pose.camera
    values = (*camera.position_table_m, camera.yaw_rad, camera.tilt_x_rad, camera.tilt_y_rad)
    quantities = {
        name: Quantity(value, float(std), "m" if name.endswith("_m") else "rad")
        for name, value, std in zip(POSE, values, pose.std, strict=True)
    }
    residual = {
        "corner_rms": Quantity(_rms(pose.residual_px), math.nan, "px"),
        "tape_rms": Quantity(_rms(pose.tape_m), math.nan, "m"),
        "tape_heading_rms": Quantity(_rms(pose.tape_rad), math.nan, "rad"),
    }
    notes = {"pictures": pictures, "corners": len(pose.residual_px)}
    provenance = provenance_of(folder / "places.csv", datetime.now(UTC))
    return CalibrationResult(
        "Pose of the camera over the table, by a board", provenance, quantities, residual, notes
    )


def _sentence(pose: OverheadPose, pictures: int) -> str:
    x, y, z = pose.camera.position_table_m
    return (
        f"the camera hangs at ({x:.4f}, {y:.4f}, {z:.4f}) m, sigma {1e3 * max(pose.std[:3]):.1f} mm and "
        f"{math.degrees(max(pose.std[3:])):.2f} deg; corners {_rms(pose.residual_px):.3f} px, "
        f"tape against pictures {1e3 * _rms(pose.tape_m):.2f} mm over {pictures} places."
    )


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt((np.asarray(values) ** 2).mean()))
