"""What a tracker answers for each frame."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.bounds import attitude_sigma_rad, position_sigma_m
from groundstation.relative_navigation.pose import Pose

Floats = NDArray[np.float64]


class Status(StrEnum):
    """What stands behind a pose; the value is the word in files."""

    SOLVED = "solved"
    """This frame showed enough points."""
    PROPAGATED = "propagated"
    """It did not: the motion model went on, and its sigma grows."""
    AMBIGUOUS = "ambiguous"
    """Several poses fit, and motion has not decided yet: the likeliest is given."""
    ALIASED = "aliased"
    """The frame's own pose is good; the target turns too fast for the frames to tell its rate."""
    LOST = "lost"
    """No pose is known."""


class Reason(StrEnum):
    """Why a frame was not solved, or what is wrong with its answer."""

    NONE = ""
    TOO_FEW_POINTS = "fewer than four points that span space"
    NO_POINTS = "no points"
    NO_AGREEMENT = "the centres do not agree with any pose"
    SEVERAL_POSES = "several poses fit"
    CONTRADICTED = "the frames contradict the motion model, the sigma is widened: is the inertia right?"
    TOO_FAST = "the target turns too fast for the frames"
    NO_SOLUTION = "the solver did not come to rest"


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """One frame's answer.

    Attributes:
        frame: Its number.
        t_s: Its time.
        status: What stands behind it.
        reason: Why it was not solved, or what is wrong with the answer all the same.
        pose: Of the body's origin; None where nothing is known.
        covariance: (6, 6), position m and turn rad in camera axes; NaN where nothing is known.
        velocity_m_s: Of the centre of mass in the orbital frame, (3,); NaN where unknown.
        rate_rad_s: Absolute, body axes, (3,); NaN where unknown.
        points: How many centres the pose rests on.
        residual_px: Root of the mean squared residual; NaN without points.
        others: Further poses that fit as well.
        matched: Point and centre of each pair, (points, 2).
    """

    frame: int
    t_s: float
    status: Status
    reason: Reason
    pose: Pose | None
    covariance: Floats
    velocity_m_s: Floats
    rate_rad_s: Floats
    points: int = 0
    residual_px: float = math.nan
    others: tuple[Pose, ...] = ()
    matched: NDArray[np.int64] | None = None

    @property
    def sigma_position_m(self) -> float:
        """Root of the summed position variances."""
        return position_sigma_m(self.covariance)

    @property
    def sigma_attitude_rad(self) -> float:
        """Root of the summed turn variances."""
        return attitude_sigma_rad(self.covariance)


NOTHING3 = np.full(3, np.nan)
NOTHING6 = np.full((6, 6), np.nan)


def lost(frame: int, t_s: float, reason: Reason) -> Track:
    """Return the answer to a frame of which nothing is known."""
    return Track(frame, t_s, Status.LOST, reason, None, NOTHING6, NOTHING3, NOTHING3)
