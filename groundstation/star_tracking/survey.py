"""The catalogue of a ceiling from a slow sweep under it: string together, anchor, adjust.

The frame of the table comes from anchors: stars measured by tape, named by a click in one picture.
They are only a gauge (position, turn, scale); the shape comes from the pictures. Reported standard
deviations are of that shape, tape errors taken out.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.camera.models import CameraCalibration
from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.rays import CeilingRays
from groundstation.star_tracking.sky_adjustment import (
    CENTRE,
    DISTORTION,
    HEIGHT,
    Adjusted,
    Observations,
    StarPrior,
    adjust,
)
from groundstation.star_tracking.sweep import Sweep, string_together

Array = NDArray[np.float64]
Index = NDArray[np.int64]

LENS = (*HEIGHT, "fy", *CENTRE, *DISTORTION)
"""Height and lens; fx is held, because a level camera's picture scales with both alike."""

_CLICK_REACH_PX = 12.0
_MIN_TIMES_SEEN = 2
_CENTRE_FLOOR_PX = 0.01


class SurveyError(ValueError):
    """The sweep or its anchors do not give a catalogue; the message is one sentence."""


@dataclass(frozen=True, slots=True)
class Anchor:
    """A star measured by tape, and where it was clicked.

    Attributes:
        name: Its id.
        x_m: By tape, table.
        y_m: By tape, table.
        frame: Index of the picture of the click.
        u_px: Of the click.
        v_px: Of the click.
    """

    name: str
    x_m: float
    y_m: float
    frame: int
    u_px: float
    v_px: float


@dataclass(frozen=True, slots=True, eq=False)
class SurveyedSky:
    """A surveyed ceiling.

    Attributes:
        ids: Names; anchors keep theirs, the rest are numbered on.
        star_m: Positions, shape (s, 2), table.
        std_m: Standard deviations of the shape, shape (s, 2).
        times_seen: Pictures that each star was used in, shape (s,).
        camera: The camera with the ceiling's height as found.
        std_height_m: One sigma of that height, the tape's errors not included.
        pose: Poses of the placed pictures, shape (f, 3).
        placed: Their indices, shape (f,).
        tape_residual_m: Anchor by tape minus as surveyed, shape (a, 2).
        adjusted: The adjustment behind it.
    """

    ids: tuple[str, ...]
    star_m: Array
    std_m: Array
    times_seen: Index
    camera: CameraCalibration
    std_height_m: float
    pose: Array
    placed: Index
    tape_residual_m: Array
    adjusted: Adjusted


def survey(
    pictures: Sequence[Spots],
    anchors: Sequence[Anchor],
    camera: CameraCalibration,
    *,
    tape_std_m: float = 3e-3,
    free: Sequence[str] = HEIGHT,
    progress: Callable[[int, float], None] | None = None,
) -> SurveyedSky:
    """Survey a ceiling.

    Args:
        pictures: Spots of the sweep's pictures, in order.
        anchors: At least two stars measured by tape.
        camera: Intrinsics and mount; its height may be 10 % off.
        tape_std_m: How well the tape was read.
        free: Camera values to adjust besides poses and stars: ``HEIGHT``, or ``LENS`` for the lens too.
        progress: Called with the step's number and the residual RMS in px.

    Raises:
        SurveyError: Anchors or overlaps do not suffice.
    """
    if len(anchors) < 2:
        raise SurveyError(f"a survey needs at least two anchors, there is {len(anchors)}")
    rays = CeilingRays(camera)
    points = [rays.look_up(p.u_px, p.v_px).q_body_m for p in pictures]
    try:
        sweep = _without_rare_stars(string_together(points))
    except ValueError as error:
        raise SurveyError(str(error)) from error
    named = np.array([_clicked(anchor, pictures, sweep) for anchor in anchors], dtype=np.int64)
    if len(set(named.tolist())) < len(anchors):
        raise SurveyError("two anchors were clicked on one star")
    tape = np.array([[a.x_m, a.y_m] for a in anchors])
    scale_turn, shift = _similarity(sweep.star_m[named], tape[:, 0] + 1j * tape[:, 1])
    star = scale_turn * sweep.star_m + shift
    origin = scale_turn * (sweep.pose[:, 0] + 1j * sweep.pose[:, 1]) + shift
    pose = np.stack((origin.real, origin.imag, sweep.pose[:, 2] + np.angle(scale_turn)), axis=1)
    guess = camera.with_height(camera.ceiling_height_above_camera_m * abs(scale_turn))
    position = np.stack((star.real, star.imag), axis=1)
    # A lens far off must not be adjusted together with rough poses: these come first.
    stages = [HEIGHT] if tuple(free) == HEIGHT else [HEIGHT, tuple(free)]
    while True:
        seen = _observations(pictures, sweep)
        known = StarPrior(named, tape, np.full(len(named), tape_std_m))
        try:
            for stage in stages:
                adjusted = adjust(guess, pose, position, seen, free=stage, known=known, progress=progress)
                guess, pose, position = adjusted.camera, adjusted.pose, adjusted.star_m
        except ValueError as error:
            raise SurveyError(str(error)) from error
        times_seen = np.bincount(sweep.star[adjusted.used], minlength=len(position))
        real = times_seen >= _MIN_TIMES_SEEN
        if not real[named].all():
            raise SurveyError("an anchor's star does not fit the other pictures")
        if real.all():
            break
        # Stray lights that happened to fall near each other: out they go, and once more.
        named = (np.cumsum(real) - 1)[named]
        position = position[real]
        sweep = _only_stars(sweep, real)
    return SurveyedSky(
        ids=_ids(anchors, named, len(position)),
        star_m=adjusted.star_m,
        std_m=shape_std_m(adjusted.star_m, adjusted.cov_star_m2),
        times_seen=times_seen,
        camera=adjusted.camera,
        std_height_m=adjusted.std_camera.get(HEIGHT[0], 0.0),
        pose=adjusted.pose,
        placed=sweep.placed,
        tape_residual_m=tape - adjusted.star_m[named],
        adjusted=adjusted,
    )


def shape_std_m(star_m: Array, cov_m2: Array) -> Array:
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
    half = cov_m2 - basis @ (basis.T @ cov_m2)
    inner = half - (half @ basis) @ basis.T
    return np.asarray(np.sqrt(np.maximum(np.diag(inner), 0.0)).reshape(n, 2))


def _clicked(anchor: Anchor, pictures: Sequence[Spots], sweep: Sweep) -> int:
    where = np.flatnonzero(sweep.placed == anchor.frame)
    if len(where) == 0:
        raise SurveyError(
            f"anchor '{anchor.name}': its picture could not be laid on the others, click it in another one"
        )
    spots = pictures[anchor.frame]
    row = np.flatnonzero(sweep.frame == where[0])
    spot = sweep.spot[row]
    distance = np.hypot(spots.u_px[spot] - anchor.u_px, spots.v_px[spot] - anchor.v_px)
    if len(distance) == 0 or distance.min() > _CLICK_REACH_PX:
        raise SurveyError(
            f"anchor '{anchor.name}': no star within {_CLICK_REACH_PX:.0f} px of the click "
            f"({anchor.u_px:.1f}, {anchor.v_px:.1f})"
        )
    return int(sweep.star[row[int(np.argmin(distance))]])


def _similarity(source: NDArray[np.complex128], goal: NDArray[np.complex128]) -> tuple[complex, complex]:
    centred = source - source.mean()
    spread = float((np.abs(centred) ** 2).sum())
    if spread < 1e-6:
        raise SurveyError("the anchors are all in one place")
    factor = complex(((goal - goal.mean()) * np.conj(centred)).sum() / spread)
    return factor, complex(goal.mean() - factor * source.mean())


def _without_rare_stars(sweep: Sweep) -> Sweep:
    """Drop what was seen too rarely to be a star."""
    seen = np.bincount(sweep.star, minlength=len(sweep.star_m))
    keep = seen >= _MIN_TIMES_SEEN
    if not keep.any():
        raise SurveyError("no star was seen in two pictures")
    return _only_stars(sweep, keep)


def _only_stars(sweep: Sweep, keep: NDArray[np.bool_]) -> Sweep:
    number = np.cumsum(keep) - 1
    kept = keep[sweep.star]
    return Sweep(
        sweep.pose,
        sweep.placed,
        sweep.star_m[keep],
        sweep.frame[kept],
        sweep.spot[kept],
        number[sweep.star[kept]],
    )


def _observations(pictures: Sequence[Spots], sweep: Sweep) -> Observations:
    pixel = np.empty((len(sweep.frame), 2))
    sigma = np.empty(len(sweep.frame))
    for row, number in enumerate(sweep.placed):
        mine = sweep.frame == row
        spots, spot = pictures[int(number)], sweep.spot[mine]
        pixel[mine, 0], pixel[mine, 1] = spots.u_px[spot], spots.v_px[spot]
        variance = 0.5 * (spots.cov_px2[spot, 0] + spots.cov_px2[spot, 2]) + _CENTRE_FLOOR_PX**2
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
