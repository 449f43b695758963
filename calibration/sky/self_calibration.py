"""The camera calibrated by the star field itself: intrinsics, or the mount by turning in place.

Pictures are solved with the camera as far as it is known, the matches adjusted together, and once
more with the better camera, because a wrong lens hides the matches near the corners at first.

What a level camera under a flat ceiling cannot tell: focal length and height scale the picture alike,
so the height is held and the focal length freed (or the other way round). The yaw of the mount turns
every heading alike, so it takes one picture whose heading is known.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from calibration.outcome import CalibrationRefusedError
from calibration.sky.sky_adjustment import (
    CENTRE,
    DISTORTION,
    FOCAL,
    HEIGHT,
    OFFSET,
    TILT,
    Adjusted,
    Observations,
    PosePriorTerm,
    StarPrior,
    adjust,
)
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.fixes import PictureFix
from groundstation.star_tracking.rays import ceiling_points
from groundstation.star_tracking.star_catalogue import StarCatalogue
from groundstation.star_tracking.tracker import StarTracker, TrackerSettings

Array = NDArray[np.float64]
Progress = Callable[[int, float], None]

_TOLERANCES_PX = (4.0, 2.5, 1.4)  # of the rounds: a wrong camera needs a wide net
_SCALES = (1.0, 0.97, 1.03, 0.94, 1.06, 0.91, 1.09, 0.88, 1.12)  # of the focal length, tried at first
_TRIED_PICTURES = 12
_CENTRE_FLOOR_PX = 0.01
_EXACT_STAR_STD_M = 2e-5
_MIN_PICTURES = 4
_MIN_SPAN_RAD = np.deg2rad(200.0)


class SkyCalibrationError(CalibrationRefusedError):
    """The pictures do not calibrate the camera; the message is one sentence."""


@dataclass(frozen=True, slots=True, eq=False)
class SkyCalibration:
    """A camera calibrated under a known sky.

    Attributes:
        camera: The camera as found.
        adjusted: The adjustment behind it, with standard deviations and residuals.
        solved: Indices of the pictures that took part.
        seen: What was adjusted to.
    """

    camera: CameraCalibration
    adjusted: Adjusted
    solved: NDArray[np.int64]
    seen: Observations


def calibrate_intrinsics(
    pictures: Sequence[Spots],
    catalogue: StarCatalogue,
    camera: CameraCalibration,
    *,
    wobble_sigma_m: float | None = None,
    progress: Progress | None = None,
) -> SkyCalibration:
    """Calibrate focal lengths, principal point and distortion; height and mount are held.

    A principal point off by one pixel looks almost like a mount that is off by one pixel on the
    ceiling, which every free pose absorbs. Pictures made by turning in place tell the two apart.

    Args:
        pictures: Spots of the pictures.
        catalogue: The stars.
        camera: First guess of the intrinsics; mount and height as known.
        wobble_sigma_m: For pictures made by turning in place: how far the body origin moved.
        progress: Called with the step's number and the residual RMS in px.

    Raises:
        SkyCalibrationError: Too few pictures can be solved, or they do not determine the lens.
    """
    in_place = None if wobble_sigma_m is None else PosePriorTerm(wobble_sigma_m)
    return _calibrate(pictures, catalogue, camera, (*FOCAL, *CENTRE, *DISTORTION), in_place, progress)


def calibrate_mount(
    pictures: Sequence[Spots],
    catalogue: StarCatalogue,
    camera: CameraCalibration,
    *,
    wobble_sigma_m: float = 1e-3,
    first_heading_rad: float | None = None,
    progress: Progress | None = None,
) -> SkyCalibration:
    """Calibrate offset, tilt and height from pictures taken while the mock-up turned in place.

    Args:
        pictures: Spots of the pictures.
        catalogue: The stars.
        camera: Intrinsics, and the mount as far as known.
        wobble_sigma_m: How far the body origin may have moved while turning.
        first_heading_rad: True heading of the first solved picture; it gives the yaw.
        progress: Called with the step's number and the residual RMS in px.

    Raises:
        SkyCalibrationError: Too few pictures can be solved, or the turn is too small.
    """
    found = _calibrate(
        pictures, catalogue, camera, (*OFFSET, *TILT, *HEIGHT), PosePriorTerm(wobble_sigma_m), progress
    )
    heading = np.unwrap(found.adjusted.pose[:, 2])
    if float(np.ptp(heading)) < _MIN_SPAN_RAD:
        raise SkyCalibrationError(
            f"the pictures cover a turn of {np.degrees(np.ptp(heading)):.0f} deg, "
            f"the mount needs {np.degrees(_MIN_SPAN_RAD):.0f} deg"
        )
    if first_heading_rad is None:
        return found
    yaw = camera.mount_yaw_rad + float(heading[0]) - first_heading_rad
    turned = _turn_mount(found.camera, float(np.arctan2(np.sin(yaw), np.cos(yaw))))
    return SkyCalibration(turned, found.adjusted, found.solved, found.seen)


def _turn_mount(camera: CameraCalibration, yaw_rad: float) -> CameraCalibration:
    """Give the mount another yaw: the offset was found in axes that turn with it."""
    turn = yaw_rad - camera.mount_yaw_rad
    x, y, z = camera.mount_offset_body_m
    c, s = np.cos(turn), np.sin(turn)
    return replace(
        camera,
        mount_yaw_rad=yaw_rad,
        mount_offset_body_m=(float(c * x - s * y), float(s * x + c * y), z),
    )


def _calibrate(
    pictures: Sequence[Spots],
    catalogue: StarCatalogue,
    camera: CameraCalibration,
    free: tuple[str, ...],
    in_place: PosePriorTerm | None,
    progress: Progress | None,
) -> SkyCalibration:
    star = np.stack((catalogue.x_m, catalogue.y_m), axis=1)
    sigma = np.maximum(catalogue.sigma_m, _EXACT_STAR_STD_M)
    known = StarPrior(np.arange(len(star)), star, sigma)
    result: SkyCalibration | None = None
    if "fx" in free:
        camera = _rough_focal_length(pictures, catalogue, camera)
    for tolerance in _TOLERANCES_PX:
        tracker = StarTracker(catalogue, camera, _settings(tolerance))
        answers = [(i, tracker.solve(spots)) for i, spots in enumerate(pictures)]
        fixes = [(i, fix) for i, fix in answers if isinstance(fix, PictureFix)]
        if len(fixes) < _MIN_PICTURES:
            raise SkyCalibrationError(
                f"{len(fixes)} of {len(pictures)} pictures could be solved, {_MIN_PICTURES} are needed"
            )
        pose = np.array([[fix.x_m, fix.y_m, fix.heading_rad] for _, fix in fixes])
        seen = _matches(pictures, fixes, star, camera, 4.0 * tolerance)
        try:
            adjusted = adjust(
                camera, pose, star, seen, free=free, known=known, in_place=in_place, progress=progress
            )
        except ValueError as error:
            raise SkyCalibrationError(str(error)) from error
        camera = adjusted.camera
        result = SkyCalibration(camera, adjusted, np.array([i for i, _ in fixes], dtype=np.int64), seen)
    assert result is not None
    return result


def _settings(tolerance_px: float) -> TrackerSettings:
    sigmas = (0.06, 0.2, 0.7, 0.7 * tolerance_px)
    return TrackerSettings(
        tolerance_px=tolerance_px, centre_floor_px=0.25 * tolerance_px, evidence_sigmas_px=sigmas
    )


def _rough_focal_length(
    pictures: Sequence[Spots], catalogue: StarCatalogue, camera: CameraCalibration
) -> CameraCalibration:
    """Give the focal length under which most of a few pictures can be solved, with most stars."""
    some = pictures[:: max(1, len(pictures) // _TRIED_PICTURES)]
    best, most = camera, -1
    for scale in _SCALES:
        scaled = replace(camera, fx=scale * camera.fx, fy=scale * camera.fy)
        tracker = StarTracker(catalogue, scaled, _settings(_TOLERANCES_PX[0]))
        answers = (tracker.solve(spots) for spots in some)
        stars = sum(answer.stars for answer in answers if isinstance(answer, PictureFix))
        if stars > most:
            best, most = scaled, stars
    return best


def _matches(
    pictures: Sequence[Spots],
    fixes: Sequence[tuple[int, PictureFix]],
    star_m: Array,
    camera: CameraCalibration,
    gate_px: float,
) -> Observations:
    """Pair spots and stars again with a gate that forgives a wrong lens near the corners."""
    gate_m = gate_px * camera.ceiling_height_above_camera_m / camera.fx
    frames, stars, pixels, sigmas = [], [], [], []
    position = star_m @ np.array([1.0, 1j])
    for row, (number, fix) in enumerate(fixes):
        spots = pictures[number]
        q, _ = ceiling_points(camera, spots.u_px, spots.v_px)
        where = np.exp(1j * fix.heading_rad) * (q @ np.array([1.0, 1j])) + complex(fix.x_m, fix.y_m)
        distance = np.abs(where[:, None] - position[None, :])
        nearest = distance.argmin(axis=1)
        mutual = distance.argmin(axis=0)[nearest] == np.arange(len(where))
        spot = np.flatnonzero(mutual & (distance.min(axis=1) < gate_m))
        frames.append(np.full(len(spot), row))
        stars.append(nearest[spot])
        pixels.append(np.stack((spots.u_px[spot], spots.v_px[spot]), axis=1))
        variance = 0.5 * (spots.covariance_px2[spot, 0] + spots.covariance_px2[spot, 2])
        sigmas.append(np.sqrt(variance + _CENTRE_FLOOR_PX**2))
    return Observations(
        np.concatenate(frames), np.concatenate(stars), np.concatenate(pixels), np.concatenate(sigmas)
    )
