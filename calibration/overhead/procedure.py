"""Where the camera over the table hangs, by a board: board views in, an outcome out."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from calibration.outcome import Outcome
from calibration.overhead.camera_pose import POSE, BoardView, OverheadPose, calibrate_overhead_pose
from calibration.overhead.figures import draw_board_pose
from calibration.overhead.tape_check import agreeing, once
from calibration.result import Quantity
from groundstation.overhead.overhead_camera import OverheadCamera

DOUBTFUL_TAPE_SIGMAS = 1.5
"""A tape that errs so many times as far as stated is worth a word."""


def pose_by_board(
    views: Sequence[BoardView],
    lens: OverheadCamera,
    tape_sigma_m: float,
    tape_sigma_rad: float,
    *,
    thickness_m: float = 0.0,
) -> Outcome:
    """Find the pose of the camera from pictures of a board on the table.

    Args:
        views: Corners, and where the tape states that the board lay.
        lens: The camera; its pose is a guess.
        tape_sigma_m: How well places were measured.
        tape_sigma_rad: How well headings were.
        thickness_m: Of the board.

    Raises:
        CalibrationRefusedError: The pictures do not suffice, or contradict the tape.
    """
    different, again = once(views)
    warnings = [f"picture '{name}' came twice and counts once" for name in again]

    def fit(some: Sequence[BoardView]) -> OverheadPose:
        return calibrate_overhead_pose(some, lens, tape_sigma_m, tape_sigma_rad, thickness_m)

    pose = agreeing(different, fit)
    if len(pose.tape_m) == 1:
        warnings.append("one place checks no tape: lay the board elsewhere, too, to see whether it was right")
    if pose.tape_sigmas > DOUBTFUL_TAPE_SIGMAS:
        warnings.append(
            f"the tape errs {pose.tape_sigmas:.2g} times as far as stated; the sigmas are that much larger"
        )
    camera = pose.camera
    values = (*camera.position_table_m, camera.yaw_rad, camera.tilt_x_rad, camera.tilt_y_rad)
    return Outcome(
        title="Pose of the camera over the table, by a board",
        summary=_sentence(pose),
        quantities={
            name: Quantity(value, float(sigma), "m" if name.endswith("_m") else "rad")
            for name, value, sigma in zip(POSE, values, pose.sigma, strict=True)
        },
        residual={
            "corner_rms": Quantity(_rms(pose.residual_px), math.nan, "px"),
            "tape_rms": Quantity(_rms(pose.tape_m), math.nan, "m"),
            "tape_heading_rms": Quantity(_rms(pose.tape_rad), math.nan, "rad"),
        },
        notes={"pictures": len(different), "corners": len(pose.residual_px)},
        draw=partial(draw_board_pose, pose.residual_px, pose.tape_m, pose.tape_rad),
        camera=camera,
        warnings=tuple(warnings),
    )


def _sentence(pose: OverheadPose) -> str:
    x, y, z = pose.camera.position_table_m
    places = f"tape against pictures {1e3 * _rms(pose.tape_m):.2f} mm over {len(pose.tape_m)} places"
    return (
        f"the camera hangs at ({x:.4f}, {y:.4f}, {z:.4f}) m, sigma {1e3 * max(pose.sigma[:3]):.1f} mm and "
        f"{math.degrees(max(pose.sigma[3:])):.2f} deg; corners {_rms(pose.residual_px):.3f} px, "
        f"{places if len(pose.tape_m) > 1 else 'one place'}."
    )


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt((np.asarray(values) ** 2).mean()))
