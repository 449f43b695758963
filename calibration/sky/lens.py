"""Lens and mount: from the stars of a known ceiling, from turning in place, from a printed board."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from calibration.outcome import CalibrationRefusedError, Outcome, adjusting
from calibration.result import Quantity
from calibration.sky.board import Board, calibrate_from_board, find_corners
from calibration.sky.figures import draw_residuals
from calibration.sky.quantities import LENS_NAMES, UNITS, camera_quantities
from calibration.sky.residual_structure import find_structure
from calibration.sky.self_calibration import (
    SkyCalibration,
    calibrate_intrinsics,
    calibrate_mount,
)
from groundstation.cli.progress import Progress, silent
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.star_catalogue import StarCatalogue


def lens_from_stars(
    pictures: Sequence[Spots],
    catalogue: StarCatalogue,
    camera: CameraCalibration,
    *,
    wobble_m: float | None = None,
    progress: Progress = silent,
) -> Outcome:
    """Calibrate focal lengths, principal point and distortion under a known ceiling.

    Args:
        pictures: Spots of the pictures.
        catalogue: The stars.
        camera: First guess of the lens; mount and height as known.
        wobble_m: For pictures made by turning in place: how far the body origin moved, one sigma.
        progress: Told how it goes.

    Raises:
        CalibrationRefusedError: Too few pictures can be solved, or they do not determine the lens.
    """
    found = calibrate_intrinsics(
        pictures, catalogue, camera, wobble_sigma_m=wobble_m, progress=adjusting(progress)
    )
    return _outcome("Camera intrinsics from the star field", found, len(pictures))


def mount_from_turn(
    pictures: Sequence[Spots],
    catalogue: StarCatalogue,
    camera: CameraCalibration,
    *,
    wobble_m: float = 1e-3,
    first_heading_rad: float | None = None,
    progress: Progress = silent,
) -> Outcome:
    """Calibrate offset, tilt and height of the camera from pictures made by turning in place.

    Args:
        pictures: Spots of the pictures.
        catalogue: The stars.
        camera: Lens, and the mount as far as known.
        wobble_m: How far the body origin moved while turning, one sigma.
        first_heading_rad: True heading of the first solved picture; it gives the yaw of the mount.
        progress: Told how it goes.

    Raises:
        CalibrationRefusedError: Too few pictures can be solved, or the turn is too small.
    """
    found = calibrate_mount(
        pictures,
        catalogue,
        camera,
        wobble_sigma_m=wobble_m,
        first_heading_rad=first_heading_rad,
        progress=adjusting(progress),
    )
    return _outcome("Camera mount by turning in place", found, len(pictures))


def lens_from_board(
    images: Iterable[NDArray[np.uint8]],
    board: Board,
    *,
    camera: CameraCalibration | None = None,
    progress: Progress = silent,
) -> Outcome:
    """Calibrate the lens from pictures of a chessboard or a ChArUco board.

    Args:
        images: Grey pictures (h, w) of one size; read one after the other.
        board: What was printed.
        camera: Whose mount and height the result's camera keeps; None: the result has no camera.
        progress: Told how it goes.

    Raises:
        CalibrationRefusedError: Pictures of two sizes, or too few that show the board.
    """
    views: list[tuple[NDArray[np.float32], NDArray[np.float32]]] = []
    size: tuple[int, ...] | None = None
    count = 0
    for image in images:
        if size is not None and image.shape != size:
            raise CalibrationRefusedError(
                f"picture {count + 1} is {image.shape[1]} x {image.shape[0]} px, those before it "
                f"{size[1]} x {size[0]}"
            )
        size = image.shape
        count += 1
        progress(f"looking for the board, seen in {len(views)} of {count}", math.nan)
        view = find_corners(image, board)
        if view is not None:
            views.append(view)
    if size is None:
        raise CalibrationRefusedError("there is no picture")
    progress("adjusting", math.nan)
    lens = calibrate_from_board(views, size[1], size[0])
    values = (lens.fx, lens.fy, lens.cx, lens.cy, *lens.distortion)
    pixel = np.concatenate([view[1] for view in views]).astype(np.float64)
    structure = find_structure(pixel, lens.residual_px, size[1], size[0])
    rms = float(np.sqrt((lens.residual_px**2).mean()))
    better = None
    if camera is not None:
        better = replace(
            camera,
            width=size[1],
            height=size[0],
            fx=lens.fx,
            fy=lens.fy,
            cx=lens.cx,
            cy=lens.cy,
            distortion=lens.distortion,
        )
    return Outcome(
        title="Camera intrinsics from a board",
        summary=f"board seen in {lens.pictures} of {count} pictures, reprojection {rms:.3f} px RMS per axis.",
        quantities={
            name: Quantity(value, sigma, UNITS[name])
            for name, value, sigma in zip(LENS_NAMES, values, lens.sigma, strict=True)
        },
        residual={
            "reprojection_rms": Quantity(rms, math.nan, "px"),
            "systematic": Quantity(structure.systematic_px, math.nan, "px"),
        },
        notes={"pictures": lens.pictures, "width": size[1], "height": size[0]},
        draw=partial(draw_residuals, lens.residual_px, structure, f"Board in {lens.pictures} pictures"),
        camera=better,
    )


def _outcome(title: str, found: SkyCalibration, pictures: int) -> Outcome:
    camera, adjusted = found.camera, found.adjusted
    used = adjusted.used
    residual_px = adjusted.residual_px[used]
    structure = find_structure(found.seen.pixel[used], residual_px, camera.width, camera.height)
    warnings: tuple[str, ...] = ()
    if structure.is_wrong:
        warnings = (
            f"the residuals depend on the place in the picture ({structure.systematic_px:.3f} px of "
            f"{structure.noise_px:.3f} px noise): the lens model does not fit, or the star list is bent",
        )
    return Outcome(
        title=title,
        summary=(
            f"{len(found.solved)} of {pictures} pictures used, residual {adjusted.rms_px:.3f} px per axis."
        ),
        quantities=camera_quantities(camera, adjusted.sigma_camera),
        residual={
            "reprojection_rms": Quantity(adjusted.rms_px, math.nan, "px"),
            "systematic": Quantity(structure.systematic_px, math.nan, "px"),
        },
        notes={"pictures": len(found.solved), "sightings": int(used.sum())},
        draw=partial(draw_residuals, residual_px, structure, title),
        warnings=warnings,
        camera=camera,
    )
