"""The poses that a target may have, each followed by a filter of its own until motion has decided."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.motion_bank import FrameInformation
from groundstation.relative_navigation.motion_filter import MotionFilter
from groundstation.relative_navigation.pinhole import PinholeCamera
from groundstation.relative_navigation.pixel_equations import whitened
from groundstation.relative_navigation.pose import Pose, Sight
from groundstation.relative_navigation.rotations import angle_between

Floats = NDArray[np.float64]

FORGOTTEN = -9.0
"""Log of the share of likelihood below which a hypothesis is given up."""
MOST = 4
STILL_POSSIBLE = 0.02
"""A share of likelihood above which another pose is spoken of."""
MERGED_RAD = 0.03
"""Hypotheses nearer than this are one."""


@dataclass(eq=False)
class Hypothesis:
    """A pose that may be the true one.

    Attributes:
        motion: Follows it.
        weight: Log of its share of the likelihood.
    """

    motion: MotionFilter
    weight: float


def frame_information(
    camera: PinholeCamera, points_from_mass_m: Floats, sight: Sight, pose: Pose
) -> FrameInformation | None:
    """Return what a frame says near a pose; None if a point would be behind the camera."""
    found = whitened(camera, points_from_mass_m[sight.point], sight, pose)
    if found is None:
        return None
    off, rows = found
    return FrameInformation(pose, rows.T @ rows, off @ rows, float(off @ off))


def settle(hypotheses: list[Hypothesis]) -> list[Hypothesis]:
    """Return what is still possible, likeliest first, with weights that sum to one."""
    kept = [each for each in hypotheses if math.isfinite(each.weight) and each.motion.is_sound()]
    kept.sort(key=lambda each: -each.weight)
    different: list[Hypothesis] = []
    for each in kept:
        pose = each.motion.estimate.pose
        if all(
            angle_between(pose.camera_from_body, other.motion.estimate.pose.camera_from_body) > MERGED_RAD
            for other in different
        ):
            different.append(each)
    if not different:
        return []
    top = different[0].weight
    total = top + math.log(sum(math.exp(each.weight - top) for each in different))
    for each in different:
        each.weight -= total
    return [each for each in different if each.weight > FORGOTTEN][:MOST]


def others_possible(hypotheses: list[Hypothesis]) -> tuple[Pose, ...]:
    """Poses beside the likeliest that cannot be left out yet."""
    return tuple(
        each.motion.estimate.pose for each in hypotheses[1:] if each.weight > math.log(STILL_POSSIBLE)
    )
