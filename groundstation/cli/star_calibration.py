"""Commands that calibrate the star camera: lens by the stars or a board, mount, delay."""

import csv
import hashlib
import json
import math
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
import typer
from numpy.typing import NDArray

from calibration.camera import CalibrationFileError, CameraCalibration, StarCatalogue
from calibration.camera.board import Board, calibrate_from_board, find_corners
from calibration.camera.delay import camera_delay
from calibration.imu.result import CalibrationResult, Provenance, Quantity
from groundstation.cli.errors import UsageError
from groundstation.cli.star_files import (
    check_targets,
    find_frames,
    read_frame,
    with_progress,
    write_atomically,
)
from groundstation.cli.star_plots import plot_delay, plot_residuals
from groundstation.star_tracking.detection import Spots, detect
from groundstation.star_tracking.self_calibration import (
    SkyCalibration,
    SkyCalibrationError,
    calibrate_intrinsics,
    calibrate_mount,
)

UNITS = {
    "fx": "px",
    "fy": "px",
    "cx": "px",
    "cy": "px",
    **dict.fromkeys(("k1", "k2", "p1", "p2", "k3"), "1"),
    **dict.fromkeys(("mount_offset_x_m", "mount_offset_y_m", "ceiling_height_above_camera_m"), "m"),
    **dict.fromkeys(("mount_tilt_x_rad", "mount_tilt_y_rad", "mount_yaw_rad"), "rad"),
}

Folder = Annotated[Path, typer.Argument(help="With camera.json, ceiling.csv and frames/.")]
Out = Annotated[Path, typer.Option(help="Result with provenance to write (TOML).")]
CameraOut = Annotated[Path | None, typer.Option(help="camera.json to write with the new values.")]
Plot = Annotated[Path | None, typer.Option(help="Residual plot to write (PNG).")]


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
    try:
        found = calibrate_intrinsics(pictures, catalogue, camera, wobble_std_m=wobble_m)
    except SkyCalibrationError as error:
        raise UsageError(f"{folder}: {error}.") from error
    _write(folder, "Camera intrinsics from the star field", found, len(pictures), out, camera_out, plot)


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
    """Calibrate the camera's mount (offset, tilt, yaw) from frames made by turning in place.

    Example:
      groundstation star-tracker mount recordings/turn --out mount.toml --first-heading-deg 90
    """
    check_targets(out, camera_out, plot)
    camera, catalogue, pictures = _pictures(folder)
    heading = None if first_heading_deg is None else math.radians(first_heading_deg)
    try:
        found = calibrate_mount(
            pictures, catalogue, camera, wobble_std_m=1e-3 * wobble_mm, first_heading_rad=heading
        )
    except SkyCalibrationError as error:
        raise UsageError(f"{folder}: {error}.") from error
    _write(folder, "Camera mount by turning in place", found, len(pictures), out, camera_out, plot)


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
    """Calibrate the lens from pictures of a chessboard or a ChArUco board.

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
    frames = find_frames(folder)
    views, size = [], None
    for path in with_progress(frames, "finding corners"):
        image = read_frame(path, None)
        if size is not None and image.shape != size:
            raise UsageError(f"{path}: is of another size than the pictures before it.")
        size = image.shape
        view = find_corners(image, printed)
        if view is not None:
            views.append(view)
    assert size is not None
    try:
        lens = calibrate_from_board(views, size[1], size[0])
    except ValueError as error:
        raise UsageError(f"{folder}: {error}.") from error
    values = (lens.fx, lens.fy, lens.cx, lens.cy, *lens.distortion)
    names = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
    quantities = {
        name: Quantity(value, std, UNITS[name])
        for name, value, std in zip(names, values, lens.std, strict=True)
    }
    rms = float(np.sqrt((lens.residual_px**2).mean()))
    result = CalibrationResult(
        "Camera intrinsics from a board",
        _provenance(folder, frames),
        quantities,
        {"reprojection_rms": Quantity(rms, math.nan, "px")},
        {"pictures": lens.pictures, "width": size[1], "height": size[0]},
    )
    write_atomically(out, result.to_toml())
    if camera_out is not None and camera is not None:
        kept = _camera(camera)
        better = replace(
            kept,
            width=size[1],
            height=size[0],
            fx=lens.fx,
            fy=lens.fy,
            cx=lens.cx,
            cy=lens.cy,
            distortion=lens.distortion,
        )
        write_atomically(camera_out, json.dumps(better.to_mapping(), indent=1) + "\n")
    if plot is not None:
        plot_residuals(plot, lens.residual_px, f"Board in {lens.pictures} pictures")
    print(f"board seen in {lens.pictures} of {len(frames)} pictures, reprojection {rms:.3f} px RMS per axis.")


def delay(
    folder: Annotated[Path, typer.Argument(help="With imu.csv and stars.csv of one recording.")],
    out: Out,
    guess_s: Annotated[float, typer.Option(help="First guess of the delay.")] = 0.05,
    plot: Plot = None,
) -> None:
    """Calibrate the camera's delay by laying star headings on the integrated turn rate.

    imu.csv needs t_s,omega_rad_s; stars.csv t_arrival_s,heading_rad. The mock-up must turn to and fro.

    Example:
      groundstation star-tracker delay recordings/wiggle --out delay.toml
    """
    check_targets(out, plot)
    gyro = _columns(folder / "imu.csv", ("t_s", "omega_rad_s"))
    stars = _columns(folder / "stars.csv", ("t_arrival_s", "heading_rad"))
    try:
        found = camera_delay(gyro[0], gyro[1], stars[0], stars[1], guess_s)
    except ValueError as error:
        raise UsageError(f"{folder}: {error}.") from error
    rms = float(np.sqrt((found.residual_rad**2).mean()))
    result = CalibrationResult(
        "Camera delay against the IMU",
        _provenance(folder, [folder / "imu.csv", folder / "stars.csv"]),
        {
            "delay": Quantity(found.delay_s, found.std_s, "s"),
            "gyro_bias": Quantity(found.gyro_bias_rad_s, math.nan, "rad/s"),
        },
        {"heading_rms": Quantity(rms, math.nan, "rad")},
        {"headings": int(found.used.sum()), "clipped": int((~found.used).sum())},
    )
    write_atomically(out, result.to_toml())
    if plot is not None:
        plot_delay(plot, stars[0][found.used], found.residual_rad, found.delay_s)
    print(f"delay {1e3 * found.delay_s:.2f} ms, one sigma {1e3 * found.std_s:.2f} ms.")


def _write(
    folder: Path,
    title: str,
    found: SkyCalibration,
    pictures: int,
    out: Path,
    camera_out: Path | None,
    plot: Path | None,
) -> None:
    mapping = found.camera.to_mapping()
    mapping.update(zip(("k1", "k2", "p1", "p2", "k3"), found.camera.distortion, strict=True))
    mapping["mount_offset_x_m"], mapping["mount_offset_y_m"], _ = found.camera.mount_offset_body_m
    quantities = {
        name: Quantity(float(mapping[name]), std, UNITS[name])
        for name, std in found.adjusted.std_camera.items()
    }
    if "mount_offset_x_m" in quantities:
        quantities["mount_yaw_rad"] = Quantity(found.camera.mount_yaw_rad, math.nan, "rad")
    result = CalibrationResult(
        title,
        _provenance(folder, [folder / "camera.json", folder / "ceiling.csv", *find_frames(folder)]),
        quantities,
        {"reprojection_rms": Quantity(found.adjusted.rms_px, math.nan, "px")},
        {"pictures": len(found.solved), "sightings": int(found.adjusted.used.sum())},
    )
    write_atomically(out, result.to_toml())
    if camera_out is not None:
        write_atomically(camera_out, json.dumps(found.camera.to_mapping(), indent=1) + "\n")
    if plot is not None:
        plot_residuals(plot, found.adjusted.residual_px[found.adjusted.used], title)
    print(
        f"{len(found.solved)} of {pictures} pictures used, residual {found.adjusted.rms_px:.3f} px per axis."
    )


def _pictures(folder: Path) -> tuple[CameraCalibration, StarCatalogue, list[Spots]]:
    cv2.setNumThreads(1)
    camera = _camera(folder / "camera.json")
    try:
        catalogue = StarCatalogue.load(folder / "ceiling.csv")
    except CalibrationFileError as error:
        raise UsageError(str(error)) from error
    frames = find_frames(folder)
    pictures = [detect(read_frame(path, camera)) for path in with_progress(frames, "finding stars")]
    return camera, catalogue, pictures


def _camera(path: Path) -> CameraCalibration:
    try:
        return CameraCalibration.load(path)
    except CalibrationFileError as error:
        raise UsageError(str(error)) from error


def _provenance(folder: Path, files: Sequence[Path]) -> Provenance:
    digest = hashlib.sha256()
    for path in files:
        digest.update(path.name.encode())
        digest.update(path.read_bytes())
    return Provenance(folder.resolve().name, digest.hexdigest(), datetime.now(UTC))


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
