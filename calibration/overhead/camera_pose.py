"""Place and attitude of the camera over the table, from a ChArUco board that lies on the table.

The lens is known. Each placement of the board is known as well as a tape tells it: its place and heading are
unknowns with that prior, so that the reported sigmas hold the tape's error. One placement is enough; several
show, by how much the tape had to be bent, whether the numbers are right. Pictures of which the tape says the
same share their unknowns: it was measured once.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from calibration.outcome import CalibrationRefusedError
from groundstation.overhead.overhead_camera import OverheadCamera

Array = NDArray[np.float64]

POSE = ("x_m", "y_m", "z_m", "yaw_rad", "tilt_x_rad", "tilt_y_rad")
CORNER_SIGMA_PX = 0.1
"""Of one corner, where the residuals say nothing smaller is true."""
MOST_TAPE_SIGMAS = 3.0
"""A tape that is this many times worse than stated, over all places, contradicts the pictures."""
MOST_CORNER_PX = 2.0
"""Corners that are left further than this are none of a flat board seen through this lens."""
_MIN_CORNERS = 8
_MOST_STEPS = 30
"""Views that agree need a few; those that contradict each other need not be fitted to the end."""


@dataclass(frozen=True, slots=True, eq=False)
class BoardView:
    """A picture of the board on the table.

    Attributes:
        board_m: Corners in the board's frame (n, 3): x along its rows, y down its columns, as printed.
        pixel: Where they are seen (n, 2).
        x_m: Board's origin (upper left corner of its print) in the table.
        y_m: Likewise.
        heading_rad: From table +x to the board's x.
        name: Of the picture, for messages.
    """

    board_m: Array
    pixel: Array
    x_m: float
    y_m: float
    heading_rad: float
    name: str = ""

    @property
    def tape(self) -> tuple[float, float, float]:
        """What was measured."""
        return self.x_m, self.y_m, self.heading_rad


@dataclass(frozen=True, slots=True, eq=False)
class OverheadPose:
    """Result.

    Attributes:
        camera: The lens that was given, with the pose found.
        sigma: Standard deviations in the order of ``POSE``.
        residual_px: Corner minus model, (n, 2).
        tape_m: By how much each placement had to be moved (k, 2), m.
        tape_rad: And turned (k,).
        tape_sigmas: How many times worse the tape is than stated, by the pictures; 0 with one placement.
    """

    camera: OverheadCamera
    sigma: Array
    residual_px: Array
    tape_m: Array
    tape_rad: Array
    tape_sigmas: float

    @property
    def is_credible(self) -> bool:
        """Whether tape and pictures say the same."""
        return self.tape_sigmas <= MOST_TAPE_SIGMAS and self.corner_rms_px <= MOST_CORNER_PX

    @property
    def corner_rms_px(self) -> float:
        """Root of the mean square of what is left of a corner's coordinates."""
        return float(np.sqrt((self.residual_px**2).mean()))


def calibrate_overhead_pose(
    views: Sequence[BoardView],
    lens: OverheadCamera,
    tape_sigma_m: float,
    tape_sigma_rad: float,
    board_height_m: float = 0.0,
) -> OverheadPose:
    """Find where the camera hangs.

    Args:
        views: The board in one or more places.
        lens: Intrinsics; its pose is not used.
        tape_sigma_m: How well places were measured, per axis.
        tape_sigma_rad: How well headings were.
        board_height_m: Thickness of the board.

    Raises:
        CalibrationRefusedError: No view, one with too few corners, or views that no camera over the
            table has.
    """
    if not views:
        raise CalibrationRefusedError("the board was found in no picture")
    if min(len(view.pixel) for view in views) < _MIN_CORNERS:
        raise CalibrationRefusedError(f"a picture shows fewer than {_MIN_CORNERS} corners of the board")
    places = list(dict.fromkeys(view.tape for view in views))
    place = [places.index(view.tape) for view in views]
    priors = np.tile((tape_sigma_m, tape_sigma_m, tape_sigma_rad), len(places))

    def misfit(x: Array) -> Array:
        corners = _corner_misfit(x, views, place, lens, board_height_m)
        return np.concatenate((corners.ravel(), x[6:] / priors))

    start = np.concatenate((_first_guess(views[0], lens, board_height_m), np.zeros(len(priors))))
    try:
        scale = np.concatenate((np.full(6, 0.01), priors))
        found = least_squares(misfit, start, x_scale=scale, max_nfev=_MOST_STEPS)
        jacobian = np.asarray(found.jac, dtype=np.float64)
        covariance = np.linalg.inv(jacobian.T @ jacobian)
    except ValueError as error:  # LinAlgError is one, too
        raise CalibrationRefusedError(f"no place of the camera fits the pictures ({error})") from error
    residual_px = _corner_misfit(found.x, views, place, lens, board_height_m) * CORNER_SIGMA_PX
    tape = found.x[6:].reshape(-1, 3)
    freedom = 3 * (len(places) - 1)  # as many as the camera's place and yaw take
    tape_sigmas = float(np.sqrt(((found.x[6:] / priors) ** 2).sum() / freedom)) if freedom else 0.0
    excess = max(1.0, float(np.sqrt((residual_px**2).mean())) / CORNER_SIGMA_PX, tape_sigmas)
    return OverheadPose(
        _camera(lens, found.x),
        np.sqrt(np.diag(covariance)[:6]) * excess,
        residual_px,
        tape[:, :2],
        tape[:, 2],
        tape_sigmas,
    )


def _camera(lens: OverheadCamera, x: Array) -> OverheadCamera:
    place = (float(x[0]), float(x[1]), float(x[2]))
    yaw, tilt_x, tilt_y = (float(value) for value in x[3:6])
    return replace(lens, position_table_m=place, yaw_rad=yaw, tilt_x_rad=tilt_x, tilt_y_rad=tilt_y)


def _on_table(view: BoardView, shift: Array, height_m: float) -> Array:
    """Corners in the table frame (n, 3): the print is seen from above, so its y runs clockwise of its x."""
    heading = view.heading_rad + shift[2]
    c, s = np.cos(heading), np.sin(heading)
    bx, by = view.board_m[:, 0], view.board_m[:, 1]
    x = view.x_m + shift[0] + c * bx + s * by
    y = view.y_m + shift[1] + s * bx - c * by
    return np.stack((x, y, np.full(len(x), height_m)), axis=1)


def _corner_misfit(
    x: Array, views: Sequence[BoardView], place: Sequence[int], lens: OverheadCamera, height_m: float
) -> Array:
    camera = _camera(lens, x)
    out = []
    for number, view in zip(place, views, strict=True):
        corners = _on_table(view, x[6 + 3 * number : 9 + 3 * number], height_m)
        seen = (corners - camera.position_table_m) @ camera.table_from_camera()
        pixel, _ = cv2.projectPoints(seen, np.zeros(3), np.zeros(3), _matrix(lens), np.array(lens.distortion))
        out.append((view.pixel - pixel.reshape(-1, 2)) / CORNER_SIGMA_PX)
    return np.concatenate(out)


def _matrix(lens: OverheadCamera) -> Array:
    return np.array([[lens.fx, 0.0, lens.cx], [0.0, lens.fy, lens.cy], [0.0, 0.0, 1.0]])


def _first_guess(view: BoardView, lens: OverheadCamera, height_m: float) -> Array:
    corners = _on_table(view, np.zeros(3), height_m)
    _, turn, shift = cv2.solvePnP(
        corners, view.pixel, _matrix(lens), np.array(lens.distortion), flags=cv2.SOLVEPNP_IPPE
    )
    table_from_camera = cv2.Rodrigues(turn)[0].T
    place = -table_from_camera @ np.asarray(shift).ravel()
    level = table_from_camera @ np.diag([1.0, -1.0, -1.0])  # Rz(yaw) Rx(tilt_x) Ry(tilt_y)
    tilt_x = float(np.arcsin(np.clip(level[2, 1], -1.0, 1.0)))
    tilt_y = float(np.arctan2(-level[2, 0], level[2, 2]))
    yaw = float(np.arctan2(-level[0, 1], level[1, 1]))
    return np.array([*place, yaw, tilt_x, tilt_y])
