"""The catalogue of a ceiling from a slow sweep under it: string together, anchor, adjust.

The frame of the table comes from anchors: stars measured by tape, named by a click in one picture.
They are only a gauge (position, turn, scale); the shape comes from the pictures. Reported standard
deviations are of that shape, tape errors taken out.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.sky.sky_adjustment import (
    CENTRE,
    DISTORTION,
    HEIGHT,
    TILT,
    Adjusted,
    Observations,
    StarPrior,
    adjust,
)
from calibration.sky.survey.linking import LinkedMap
from calibration.sky.survey.sweep_parts import (
    MIN_TIMES_SEEN,
    Anchor,
    SurveyError,
    link_pictures,
    only_stars,
    part_with_anchors,
)
from calibration.sky.survey.tape import TapeError, fit_tape
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.projection import project
from groundstation.star_tracking.rays import CeilingRays

__all__ = ["LENS", "Anchor", "SurveyError", "SurveyedSky", "shape_sigma_m", "survey"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

LENS = (*HEIGHT, *TILT, "fy", *CENTRE, *DISTORTION)
"""Height, tilt of the mount and lens; fx is held: a level camera's picture scales with both alike."""

_LENS_ROUNDS = 3  # a wrong lens tears stars apart near the corners: link again with the better one
_MIN_SEEN_RATIO = 0.2  # of the pictures that should show a star; stray lights coincide by chance
_EDGE_PX = 12.0  # a star so near the edge of the picture need not be seen
_CENTRE_FLOOR_PX = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class SurveyedSky:
    """A surveyed ceiling.

    Attributes:
        ids: Names; anchors keep theirs, the rest are numbered on.
        star_m: Positions, shape (s, 2), table.
        sigma_m: Standard deviations of the shape, shape (s, 2).
        times_seen: Pictures that each star was used in, shape (s,).
        camera: The camera with the ceiling's height as found.
        sigma_height_m: One sigma of that height, the tape's errors not included.
        pose: Poses of the placed pictures, shape (f, 3).
        placed: Their indices, shape (f,).
        part_sizes: Pictures of each part into which the sweep fell, the largest first; one number if it held.
        anchors: Names of the anchors that lie in the part that was surveyed.
        tape_residual_m: These anchors by tape minus as surveyed, shape (a, 2).
        adjusted: The adjustment behind it.
        seen: What it was adjusted to.
    """

    ids: tuple[str, ...]
    star_m: Array
    sigma_m: Array
    times_seen: Index
    camera: CameraCalibration
    sigma_height_m: float
    pose: Array
    placed: Index
    part_sizes: tuple[int, ...]
    anchors: tuple[str, ...]
    tape_residual_m: Array
    adjusted: Adjusted
    seen: Observations


def survey(
    pictures: Sequence[Spots],
    anchors: Sequence[Anchor],
    camera: CameraCalibration,
    *,
    tape_sigma_m: float = 3e-3,
    free: Sequence[str] = HEIGHT,
    progress: Callable[[int, float], None] | None = None,
) -> SurveyedSky:
    """Survey a ceiling.

    Args:
        pictures: Spots of the sweep's pictures, in order.
        anchors: At least two stars measured by tape.
        camera: Intrinsics and mount; its height may be 10 % off.
        tape_sigma_m: How well the tape was read.
        free: Camera values to adjust besides poses and stars: ``HEIGHT``, or ``LENS`` for the lens too.
        progress: Called with the step's number and the residual RMS in px.

    Raises:
        SurveyError: Anchors or overlaps do not suffice.
    """
    if len(anchors) < 2:
        raise SurveyError(f"a survey needs at least two anchors, there is {len(anchors)}")
    sky = _survey_once(pictures, anchors, camera, tape_sigma_m, free, progress)
    for _ in range(1, 1 if tuple(free) == HEIGHT else _LENS_ROUNDS):
        sky = _survey_once(pictures, anchors, sky.camera, tape_sigma_m, free, progress)
    return sky


def _survey_once(
    pictures: Sequence[Spots],
    anchors: Sequence[Anchor],
    camera: CameraCalibration,
    tape_sigma_m: float,
    free: Sequence[str],
    progress: Callable[[int, float], None] | None,
) -> SurveyedSky:
    """Link, anchor and adjust with a camera as far as it is known."""
    parts = link_pictures(pictures, CeilingRays(camera))
    sweep, anchors, named = part_with_anchors(parts, anchors, pictures)
    tape = np.array([[a.x_m, a.y_m] for a in anchors])
    try:
        fit = fit_tape(
            [a.name for a in anchors], sweep.star_m[named], tape[:, 0] + 1j * tape[:, 1], tape_sigma_m
        )
    except TapeError as error:
        raise SurveyError(str(error)) from error
    star = fit.factor * sweep.star_m + fit.shift_m
    origin = fit.factor * (sweep.pose[:, 0] + 1j * sweep.pose[:, 1]) + fit.shift_m
    pose = np.stack((origin.real, origin.imag, sweep.pose[:, 2] + np.angle(fit.factor)), axis=1)
    guess = camera.with_height(camera.ceiling_height_above_camera_m * abs(fit.factor))
    position = np.stack((star.real, star.imag), axis=1)
    # A lens far off must not be adjusted together with rough poses: these come first.
    stages = [HEIGHT] if tuple(free) == HEIGHT else [HEIGHT, tuple(free)]
    while True:
        seen = _observations(pictures, sweep)
        known = StarPrior(named, tape, np.full(len(named), tape_sigma_m))
        try:
            for stage in stages:
                adjusted = adjust(guess, pose, position, seen, free=stage, known=known, progress=progress)
                guess, pose, position = adjusted.camera, adjusted.pose, adjusted.star_m
        except ValueError as error:
            raise SurveyError(str(error)) from error
        times_seen = np.bincount(sweep.star[adjusted.used], minlength=len(position))
        expected = _times_expected(adjusted)
        real = times_seen >= np.maximum(MIN_TIMES_SEEN, _MIN_SEEN_RATIO * expected)
        real[named] |= times_seen[named] >= MIN_TIMES_SEEN
        if not real[named].all():
            raise SurveyError("an anchor's star does not fit the other pictures")
        if real.all():
            break
        # Stray lights that happened to fall near each other: out they go, and once more.
        named = (np.cumsum(real) - 1)[named]
        position = position[real]
        sweep = only_stars(sweep, real)
    return SurveyedSky(
        ids=_ids(anchors, named, len(position)),
        star_m=adjusted.star_m,
        sigma_m=shape_sigma_m(adjusted.star_m, adjusted.covariance_star_m2),
        times_seen=times_seen,
        camera=adjusted.camera,
        sigma_height_m=adjusted.sigma_camera.get(HEIGHT[0], 0.0),
        pose=adjusted.pose,
        placed=sweep.placed,
        part_sizes=tuple(len(part.placed) for part in parts),
        anchors=tuple(anchor.name for anchor in anchors),
        tape_residual_m=tape - adjusted.star_m[named],
        adjusted=adjusted,
        seen=seen,
    )


def shape_sigma_m(star_m: Array, covariance_m2: Array) -> Array:
    """Give standard deviations (s, 2) with position, turn and scale of the whole sky taken out.

    The covariance is projected off the four directions of a similarity (the inner constraints of a
    free network; Baarda's S-transformation, 1973).
    """
    n = len(star_m)
    centred = star_m - star_m.mean(axis=0)
    gauge = np.zeros((n, 2, 4))
    gauge[:, 0, 0] = gauge[:, 1, 1] = 1.0
    gauge[:, 0, 2], gauge[:, 1, 2] = -centred[:, 1], centred[:, 0]
    gauge[:, :, 3] = centred
    basis, _ = np.linalg.qr(gauge.reshape(2 * n, 4))
    half = covariance_m2 - basis @ (basis.T @ covariance_m2)
    inner = half - (half @ basis) @ basis.T
    return np.asarray(np.sqrt(np.maximum(np.diag(inner), 0.0)).reshape(n, 2))


def _times_expected(adjusted: Adjusted) -> Index:
    """Count the pictures inside which each star should have been seen, shape (s,)."""
    camera = adjusted.camera
    count = np.zeros(len(adjusted.star_m), dtype=np.int64)
    for pose in adjusted.pose:
        pixel, _ = project(camera, np.broadcast_to(pose, (len(count), 3)), adjusted.star_m)
        # Far outside, a polynomial distortion folds back into the picture: judge by distance first.
        near = np.hypot(*(adjusted.star_m - pose[:2]).T) < camera.ceiling_height_above_camera_m
        inside = (pixel > _EDGE_PX).all(axis=1)
        inside &= (pixel < np.array([camera.width, camera.height]) - 1.0 - _EDGE_PX).all(axis=1)
        count += near & inside
    return count


def _observations(pictures: Sequence[Spots], sweep: LinkedMap) -> Observations:
    pixel = np.empty((len(sweep.frame), 2))
    sigma = np.empty(len(sweep.frame))
    for row, number in enumerate(sweep.placed):
        mine = sweep.frame == row
        spots, spot = pictures[int(number)], sweep.spot[mine]
        pixel[mine, 0], pixel[mine, 1] = spots.u_px[spot], spots.v_px[spot]
        variance = 0.5 * (spots.covariance_px2[spot, 0] + spots.covariance_px2[spot, 2]) + _CENTRE_FLOOR_PX**2
        sigma[mine] = np.sqrt(variance)
    return Observations(sweep.frame, sweep.star, pixel, sigma)


def _ids(anchors: Sequence[Anchor], named: Index, count: int) -> tuple[str, ...]:
    taken = {int(star): anchor.name for anchor, star in zip(anchors, named, strict=True)}
    numbers = [int(anchor.name) for anchor in anchors if anchor.name.isdecimal()]
    following = max(numbers, default=-1) + 1
    ids = []
    for star in range(count):
        if star in taken:
            ids.append(taken[star])
        else:
            ids.append(str(following))
            following += 1
    return tuple(ids)
