"""A frame with what was found drawn in: centres, points where the pose puts them, axes, residuals."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.answers import Status, Track
from groundstation.relative_navigation.matching import Centres
from groundstation.relative_navigation.pinhole import PinholeCamera
from groundstation.relative_navigation.pixel_equations import predicted_pixels
from groundstation.relative_navigation.target import Target

Picture = NDArray[np.uint8]

_COLOURS = {
    Status.SOLVED: (80, 220, 80),
    Status.AMBIGUOUS: (0, 200, 255),
    Status.ALIASED: (0, 200, 255),
    Status.PROPAGATED: (0, 140, 255),
    Status.LOST: (60, 60, 255),
}
_CENTRE = (255, 200, 0)
_RESIDUAL = (60, 60, 255)
MAGNIFIED = 20.0
"""Residuals are drawn so many times their length."""
_FINE = 4
"""Fractions of a pixel in OpenCV's fixed-point coordinates: 2^-4."""


def draw_track(
    picture: Picture, camera: PinholeCamera, target: Target, track: Track, centres: Centres
) -> Picture:
    """Return a picture (h, w, 3) with an answer drawn in; the picture itself stays."""
    found = picture.copy()
    if picture.ndim == 2:
        found = np.asarray(cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
    colour = _COLOURS[track.status]
    for u, v in centres.pixels.tolist():
        cv2.circle(found, _fine(u, v), 7 << _FINE, _CENTRE, 1, cv2.LINE_AA, _FINE)
    if track.pose is not None:
        places = predicted_pixels(camera, target.points_body_m, track.pose)
        for row, (u, v) in enumerate(places.tolist()):
            if np.isfinite(u):
                cv2.drawMarker(found, (round(u), round(v)), colour, cv2.MARKER_CROSS, 9, 1, cv2.LINE_AA)
                cv2.putText(found, str(row), (round(u) + 8, round(v) - 6), 0, 0.35, colour, 1, cv2.LINE_AA)
        for point, centre in [] if track.matched is None else track.matched.tolist():
            begin, end = places[point], centres.pixels[centre]
            end = begin + MAGNIFIED * (end - begin)
            cv2.line(found, _fine(*begin), _fine(*end), _RESIDUAL, 1, cv2.LINE_AA, _FINE)
        _axes(found, camera, target, track)
    for row, words in enumerate(caption(track)):
        place = (8, 18 + 17 * row)
        cv2.putText(found, words, place, 0, 0.45, (0, 0, 0), 3, cv2.LINE_AA)
        cv2.putText(found, words, place, 0, 0.45, colour, 1, cv2.LINE_AA)
    return found


def caption(track: Track) -> list[str]:
    """What stands in a corner of the frame."""
    lines = [f"frame {track.frame}  t {track.t_s:.3f} s  {track.status.value}"]
    if track.reason.value:
        lines.append(track.reason.value)
    if track.pose is not None:
        x, y, z = track.pose.position_camera_m.tolist()
        lines.append(f"x {x:.3f} y {y:.3f} z {z:.3f} m, sigma {track.sigma_position_m:.4f} m")
        residual = "" if np.isnan(track.residual_px) else f", residual {track.residual_px:.3f} px"
        lines.append(
            f"turn sigma {np.degrees(track.sigma_attitude_rad):.3f} deg, {track.points} points{residual}"
        )
    return lines


def _axes(found: Picture, camera: PinholeCamera, target: Target, track: Track) -> None:
    """Body axes as long as a third of the target: x red, y green, z blue."""
    if track.pose is None:
        return
    length = float(np.ptp(target.points_body_m, axis=0).max()) / 3.0
    ends = predicted_pixels(camera, np.vstack((np.zeros(3), length * np.eye(3))), track.pose)
    if not np.all(np.isfinite(ends)) or np.abs(ends).max() > 1e5:
        return
    for end, colour in zip(ends[1:], ((60, 60, 230), (60, 200, 60), (230, 120, 60)), strict=True):
        cv2.line(found, _fine(*ends[0]), _fine(*end), colour, 1, cv2.LINE_AA, _FINE)


def _fine(u: float, v: float) -> tuple[int, int]:
    scale = float(1 << _FINE)
    return round(float(np.clip(u, -1e5, 1e5)) * scale), round(float(np.clip(v, -1e5, 1e5)) * scale)
