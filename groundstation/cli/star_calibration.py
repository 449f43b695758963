"""Commands that calibrate the star camera: lens by the stars or a board, mount, delay."""

import csv
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
import typer
from numpy.typing import NDArray

from calibration.sky.board import Board
from calibration.sky.delay import delay_from_headings
from calibration.sky.lens import lens_from_board, lens_from_stars, mount_from_turn
from groundstation.cli.delay_source import Turns, turns_of
from groundstation.cli.errors import UsageError
from groundstation.cli.star_files import check_targets, find_frames, read_frame, with_progress
from groundstation.cli.star_outcome import progress_line, refusing, write_outcome
from groundstation.files.errors import FileError
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import Spots, detect
from groundstation.star_tracking.star_catalogue import StarCatalogue

Folder = Annotated[Path, typer.Argument(help="With camera.json, ceiling.csv and frames/.")]
Out = Annotated[Path, typer.Option(help="Result with provenance to write (TOML).")]
CameraOut = Annotated[Path | None, typer.Option(help="camera.json to write with the new values.")]
Plot = Annotated[Path | None, typer.Option(help="Residual plot to write (PNG).")]
_GUESS_S = 0.05


def intrinsics(
    folder: Folder,
    out: Out,
    camera_out: CameraOut = None,
    plot: Plot = None,
    wobble_mm: Annotated[
        float | None,
        typer.Option(help="The frames were made turning in place; the origin moved so far.", min=1e-3),
    ] = None,
) -> None:
    """Calibrate the lens from the star field itself.

    Frames made by turning in place (--wobble-mm) also separate the principal point from the mount.

    Example:
      groundstation star-tracker intrinsics recordings/turn --out lens.toml --camera-out camera.json
    """
    check_targets(out, camera_out, plot)
    camera, catalogue, pictures = _pictures(folder)
    wobble_m = None if wobble_mm is None else 1e-3 * wobble_mm
    with refusing(folder), progress_line() as progress:
        found = lens_from_stars(pictures, catalogue, camera, wobble_m=wobble_m, progress=progress)
    write_outcome(folder, found, _files(folder), out, camera_out, plot)


def mount(
    folder: Folder,
    out: Out,
    camera_out: CameraOut = None,
    plot: Plot = None,
    wobble_mm: Annotated[float, typer.Option(help="How far the body origin moved.", min=1e-3)] = 1.0,
    first_heading_deg: Annotated[
        float | None, typer.Option(help="True heading of the first frame; it gives the mount's yaw.")
    ] = None,
) -> None:
    """Calibrate offset, tilt and yaw of the camera.

    The frames are made by turning the mock-up in place.

    Example:
      groundstation star-tracker mount recordings/turn --out mount.toml --first-heading-deg 90
    """
    check_targets(out, camera_out, plot)
    camera, catalogue, pictures = _pictures(folder)
    heading = None if first_heading_deg is None else math.radians(first_heading_deg)
    with refusing(folder), progress_line() as progress:
        found = mount_from_turn(
            pictures,
            catalogue,
            camera,
            wobble_m=1e-3 * wobble_mm,
            first_heading_rad=heading,
            progress=progress,
        )
    write_outcome(folder, found, _files(folder), out, camera_out, plot)


def board(
    folder: Annotated[Path, typer.Argument(help="With frames/ of a chessboard or ChArUco board.")],
    out: Out,
    squares: Annotated[str, typer.Option(help="Squares of the board, as 9x6.")] = "9x6",
    square_mm: Annotated[float, typer.Option(help="Edge of a square.", min=0.1)] = 30.0,
    marker_mm: Annotated[float, typer.Option(help="Edge of a ChArUco marker; 0: plain.", min=0.0)] = 0.0,
    camera: Annotated[Path | None, typer.Option(help="camera.json whose other keys to keep.")] = None,
    camera_out: CameraOut = None,
    plot: Plot = None,
) -> None:
    """Calibrate the lens by pictures of a board.

    A chessboard or a ChArUco board, seen at many angles all over the picture.

    Example:
      groundstation star-tracker board recordings/board --squares 9x6 --square-mm 30 --out lens.toml
    """
    cv2.setNumThreads(1)
    check_targets(out, camera_out, plot)
    columns, _, rows = squares.partition("x")
    if not (columns.isdecimal() and rows.isdecimal()):
        raise UsageError(f"--squares is '{squares}', expected columns x rows like 9x6.")
    if camera_out is not None and camera is None:
        raise UsageError("--camera-out needs --camera, which gives the mount and the height.")
    try:
        printed = Board(int(columns), int(rows), 1e-3 * square_mm, 1e-3 * marker_mm)
    except ValueError as error:
        raise UsageError(f"{error}.") from error
    kept = None if camera is None else _camera(camera)
    frames = find_frames(folder)
    with refusing(folder), progress_line() as progress:
        found = lens_from_board(_same_size(frames), printed, camera=kept, progress=progress)
    write_outcome(folder, found, frames, out, camera_out, plot)


def delay(
    source: Annotated[Path, typer.Argument(help="Recording (.mcap), or folder with imu.csv and stars.csv.")],
    out: Out,
    guess_s: Annotated[
        float | None, typer.Option(help="First guess of the delay; default: the rig's, or 0.05.")
    ] = None,
    vehicle: Annotated[str | None, typer.Option(help="Whose, if the recording holds several.")] = None,
    plot: Plot = None,
) -> None:
    """Calibrate the camera's delay against the IMU.

    Star headings are laid on the integrated turn rate.
    The mock-up must turn to and fro. imu.csv needs t_s,omega_rad_s; stars.csv t_arrival_s,heading_rad.
    The rig reads the result: delay_file = "delay.toml" in its star_camera section.

    Example:
      groundstation star-tracker delay recordings/wiggle.mcap --out delay.toml
    """
    check_targets(out, plot)
    if source.is_dir():
        files = [source / "imu.csv", source / "stars.csv"]
        gyro = _columns(files[0], ("t_s", "omega_rad_s"))
        stars = _columns(files[1], ("t_arrival_s", "heading_rad"))
        turns = Turns(gyro[0], gyro[1], stars[0], stars[1], _GUESS_S)
    else:
        files, turns = [source], turns_of(source, vehicle)
    with refusing(source), progress_line() as progress:
        found = delay_from_headings(
            turns.gyro_t_s,
            turns.rate_rad_s,
            turns.arrival_t_s,
            turns.heading_rad,
            guess_s=turns.guess_s if guess_s is None else guess_s,
            progress=progress,
        )
    write_outcome(source, found, files, out, None, plot)


def _pictures(folder: Path) -> tuple[CameraCalibration, StarCatalogue, list[Spots]]:
    cv2.setNumThreads(1)
    camera = _camera(folder / "camera.json")
    try:
        catalogue = StarCatalogue.load(folder / "ceiling.csv")
    except FileError as error:
        raise UsageError(str(error)) from error
    frames = find_frames(folder)
    pictures = [detect(read_frame(path, camera)) for path in with_progress(frames, "finding stars")]
    return camera, catalogue, pictures


def _files(folder: Path) -> list[Path]:
    return [folder / "camera.json", folder / "ceiling.csv", *find_frames(folder)]


def _same_size(frames: list[Path]) -> Iterator[NDArray[np.uint8]]:
    """Read pictures one after the other; the first decides their size."""
    size = None
    for path in frames:
        image = read_frame(path, None)
        if size is not None and image.shape != size:
            raise UsageError(f"{path}: is of another size than the pictures before it.")
        size = image.shape
        yield image


def _camera(path: Path) -> CameraCalibration:
    try:
        return CameraCalibration.load(path)
    except FileError as error:
        raise UsageError(str(error)) from error


def _columns(path: Path, names: tuple[str, ...]) -> list[NDArray[np.float64]]:
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise UsageError(f"{path}: cannot be read ({getattr(error, 'strerror', None) or error}).") from error
    if not rows:
        raise UsageError(f"{path}: holds no row.")
    columns = []
    for name in names:
        if name not in rows[0]:
            raise UsageError(f"{path}: column '{name}' is missing.")
        values = np.empty(len(rows))
        for i, row in enumerate(rows):
            try:
                values[i] = float(row[name])
            except (TypeError, ValueError):
                values[i] = math.nan
            if not math.isfinite(values[i]):
                raise UsageError(f"{path}: line {i + 2}, {name} is '{row[name]}', expected a number.")
        columns.append(values)
    return columns
