"""Target files written from clicks on a picture and measured lengths, with the pose as a check of both."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.files.errors import FileError
from groundstation.files.toml_file import Value, toml_lines, toml_table
from groundstation.relative_navigation.first_poses import best_of, cold_starts
from groundstation.relative_navigation.pinhole import PinholeCamera
from groundstation.relative_navigation.pose import Sight
from groundstation.relative_navigation.target import Target

Picture = NDArray[np.uint8]

CLICK_PX = 1.5
"""How well a person clicks."""
PATCH_PX = 2
"""Half a side of the patch around a click whose colour counts."""
POOR_PX = 6.0
"""A residual above this says that a click or a length is wrong."""


@dataclass(frozen=True, slots=True)
class ClickedPoint:
    """A point: where it was clicked, u and v, and where it is on the craft, m."""

    pixel: tuple[float, float]
    place_m: tuple[float, float, float]


def target_toml(
    picture: Picture,
    points: Sequence[ClickedPoint],
    f_px: float,
    tip_diameter_m: float | None,
    *,
    learns_colours: bool,
) -> tuple[str, str]:
    """Return the text of a target file, and a sentence about the check.

    Raises:
        FileError: The points are none of a target, or colours are wanted of a grey picture.
    """
    height, width = picture.shape[:2]
    try:
        camera = PinholeCamera(f_px, 0.5 * (width - 1), 0.5 * (height - 1), width, height)
        target = Target(np.array([point.place_m for point in points]))
    except ValueError as error:
        raise FileError(f"{error}.") from error
    if learns_colours and picture.ndim == 2:
        raise FileError("--colours needs a picture in colour.")
    values: dict[str, Value] = {
        "points_m": [list(point.place_m) for point in points],
        "sigma_px": 0.3,
        "labelled": False,
    }
    lines = toml_lines(values)
    if tip_diameter_m is not None:
        lines += toml_lines({"tip_diameter_m": tip_diameter_m})
    lines.append("# inertia = [1.6, 1.16, 1.86]  # principal moments, if they are known; ratios count")
    lines += toml_table(
        "camera", {"f_px": f_px, "cx": camera.cx_px, "cy": camera.cy_px, "width": width, "height": height}
    )
    words, guess = _check(camera, target, points)
    if guess is not None:
        lines += toml_table("guess_frame0", guess)
    if learns_colours:
        for row, point in enumerate(points):
            patch = _patch(picture, point.pixel)
            lines += toml_table("markers", {"point": row, "clicked": patch.tolist()}, is_row=True)
    return "\n".join(lines) + "\n", words


def _patch(picture: Picture, pixel: tuple[float, float]) -> Picture:
    u, v = round(pixel[0]), round(pixel[1])
    patch = picture[max(0, v - PATCH_PX) : v + PATCH_PX + 1, max(0, u - PATCH_PX) : u + PATCH_PX + 1]
    return np.asarray(patch.reshape(-1, 3)[::3], dtype=np.uint8)


def _check(
    camera: PinholeCamera, target: Target, points: Sequence[ClickedPoint]
) -> tuple[str, dict[str, list[float]] | None]:
    pixels = np.array([point.pixel for point in points])
    sight = Sight(np.arange(len(points)), pixels, 1.0 / CLICK_PX)
    if len(points) < 4:
        return f"{len(points)} points written; four or more would be checked by a pose.", None
    apart_px = np.linalg.norm(pixels[:, None] - pixels[None], axis=2)[np.triu_indices(len(points), 1)]
    if float(apart_px.min()) < CLICK_PX:
        return f"{len(points)} points written; two clicks are in one place, so no pose checks them.", None
    fits = best_of(camera, target, sight, cold_starts(camera, target, sight))
    if not fits:
        return (
            f"{len(points)} points written; no pose fits the clicks: one of them, or a length, is wrong.",
            None,
        )
    fit = fits[0]
    residual = CLICK_PX * math.sqrt(fit.cost / (2.0 * len(points)))
    x, y, z = fit.pose.position_camera_m.tolist()
    words = (
        f"{len(points)} points written; the pose at ({x:.3f}, {y:.3f}, {z:.3f}) m leaves {residual:.2f} px"
    )
    if residual > POOR_PX:
        return f"{words}: a click, a length or the focal length is wrong.", None
    guess = {"q": fit.pose.quaternion.tolist(), "t": fit.pose.position_camera_m.tolist()}
    return f"{words}.", guess
