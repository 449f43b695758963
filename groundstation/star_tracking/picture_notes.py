"""What can be reported of one picture for people: which light is what, and where stars should be.

A refused picture is worth little without the question why. These notes put a name to every light and
a place to every star, by the pose of the fix, else by the pose that the refused search came nearest
to, else by what the filter believed.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.fixes import NoFix, PictureFix, PoseGuess, PosePrior
from groundstation.star_tracking.projection import project
from groundstation.star_tracking.star_catalogue import StarCatalogue

NO_SPOT = 255
"""In ``spot_of_star``: the star was not seen."""

_STREAK_PX = 6.0
_NEAR_PX = 4.0  # without a fix: a light so near to a star's place may be that star
_REACH_RATIO = 1.5  # heights: farther away a polynomial lens folds stars back into the picture


class SpotKind(IntEnum):
    """What a light spot is."""

    LIGHT = 0  # no pose, so nobody knows
    STAR = 1
    STRAY = 2  # there is a pose, and no star of the catalogue there
    STREAK = 3  # drawn out by motion, and no star of the catalogue


@dataclass(frozen=True, slots=True, eq=False)
class PictureNotes:
    """Names of lights and places of stars in one picture.

    Attributes:
        spot_px: Centres of the spots, shape (n, 2).
        kind: ``SpotKind`` of each, shape (n,), uint8.
        stars: Ids of the stars that the picture should show.
        star_px: Where, shape (k, 2).
        spot_of_star: Which spot each of them is, or ``NO_SPOT``, shape (k,), uint8.
        basis: What the places rest on: ``fix``, ``guess``, ``state``, or empty: then there are no stars.
        pose: x and y in m, heading in rad, of that basis; NaN without one.
    """

    spot_px: NDArray[np.float64]
    kind: NDArray[np.uint8]
    stars: tuple[str, ...]
    star_px: NDArray[np.float64]
    spot_of_star: NDArray[np.uint8]
    basis: str
    pose: tuple[float, float, float]


def take_notes(
    spots: Spots,
    answer: PictureFix | NoFix,
    camera: CameraCalibration,
    catalogue: StarCatalogue,
    belief: PosePrior | None = None,
) -> PictureNotes:
    """Say of one picture which light is what.

    Args:
        spots: Its light spots.
        answer: What the star tracker made of them.
        camera: The camera.
        catalogue: The stars.
        belief: What was believed of the pose, used or not.
    """
    spot_px = np.stack((spots.u_px, spots.v_px), axis=1)
    is_streak = np.hypot(spots.streak_px[:, 0], spots.streak_px[:, 1]) > _STREAK_PX
    basis, pose = _basis(answer, belief)
    if not basis:
        kind = np.where(is_streak, SpotKind.STREAK, SpotKind.LIGHT).astype(np.uint8)
        none = np.zeros(0, np.uint8)
        return PictureNotes(spot_px, kind, (), np.zeros((0, 2)), none, "", pose)
    rows, star_px = _in_picture(camera, catalogue, pose)
    spot_of_star = np.full(len(rows), NO_SPOT, dtype=np.uint8)
    if isinstance(answer, PictureFix):
        place = {int(row): i for i, row in enumerate(rows)}
        for spot, star in zip(answer.spot_index.tolist(), answer.star_index.tolist(), strict=True):
            if star in place:
                spot_of_star[place[star]] = spot
    elif len(rows) and len(spot_px):
        distance = np.hypot(*(star_px[:, None] - spot_px[None, :]).transpose(2, 0, 1))
        nearest = distance.argmin(axis=1)
        is_near = distance.min(axis=1) < _NEAR_PX
        spot_of_star[is_near] = nearest[is_near]
    kind = np.where(is_streak, SpotKind.STREAK, SpotKind.STRAY).astype(np.uint8)
    kind[spot_of_star[spot_of_star != NO_SPOT]] = SpotKind.STAR
    if isinstance(answer, PictureFix):
        kind[answer.spot_index] = SpotKind.STAR
    stars = tuple(catalogue.ids[row] for row in rows)
    return PictureNotes(spot_px, kind, stars, star_px, spot_of_star, basis, pose)


def _basis(answer: PictureFix | NoFix, belief: PosePrior | None) -> tuple[str, tuple[float, float, float]]:
    if isinstance(answer, PictureFix):
        return "fix", (answer.x_m, answer.y_m, answer.heading_rad)
    if isinstance(answer.guess, PoseGuess):
        return "guess", (answer.guess.x_m, answer.guess.y_m, answer.guess.heading_rad)
    if belief is not None:
        return "state", (belief.x_table_m, belief.y_table_m, belief.heading_rad)
    return "", (np.nan, np.nan, np.nan)


def _in_picture(
    camera: CameraCalibration, catalogue: StarCatalogue, pose: tuple[float, float, float]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Rows and pixels (k, 2) of the stars that a picture from a pose shows."""
    star_m = np.stack((catalogue.x_m, catalogue.y_m), axis=1)
    distance = np.hypot(star_m[:, 0] - pose[0], star_m[:, 1] - pose[1])
    rows = np.flatnonzero(distance < _REACH_RATIO * camera.ceiling_height_above_camera_m)
    pixel, _ = project(camera, np.broadcast_to(pose, (len(rows), 3)), star_m[rows])
    inside = ((pixel > -0.5) & (pixel < (camera.width - 0.5, camera.height - 0.5))).all(axis=1)
    return rows[inside], pixel[inside]
