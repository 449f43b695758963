"""Fixes that a source gives again: noise never repeats, so such a source is frozen, or plays a loop."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from groundstation.fusion.noise import NoiseModel

REMEMBERED = 64
"""Poses of each source; a loop of more is not noticed."""
REPEATS = "repeats a fix before"
"""Reason of an account."""

COARSE_SIGMAS = 0.05
"""Steps of a table's numbers, in sigmas of a fix."""

Pose = tuple[float, float, float]
"""x, y (m) and heading (rad)."""


class FixRepeats:
    """The poses that each source gave lately."""

    __slots__ = ("_poses",)

    def __init__(self) -> None:
        self._poses: dict[str, deque[Pose]] = {}

    def is_repeated(self, source: str, pose: Pose) -> bool:
        """Take a pose at its arrival; True where its source gave it before, all three numbers equal."""
        poses = self._poses.setdefault(source, deque(maxlen=REMEMBERED))
        if pose in poses:
            return True
        poses.append(pose)
        return False


def repeated_fixes(stars: NDArray[np.float64], noise: NoiseModel) -> NDArray[np.bool_]:
    """Return which fixes of a table (m, 5), in the order of arrival, give a pose that was given before.

    Poses that are written with few digits repeat by chance: then a fix must have the exposure, too.
    """
    is_again = np.zeros(len(stars), dtype=np.bool_)
    columns = [0, 2, 3, 4] if _is_coarse(stars, noise) else [2, 3, 4]
    known = np.flatnonzero(np.isfinite(stars[:, columns]).all(axis=1))
    _, first = np.unique(stars[known][:, columns], axis=0, return_index=True)
    is_again[np.delete(known, first)] = True
    return is_again


def _is_coarse(stars: NDArray[np.float64], noise: NoiseModel) -> bool:
    """Whether two of the columns have steps that are large against the noise."""
    coarse, xy_m = 0, noise.star_sigma_xy_m
    for column, sigma in ((2, xy_m), (3, xy_m), (4, noise.star_sigma_heading_rad)):
        levels = np.unique(stars[np.isfinite(stars[:, column]), column])
        coarse += len(levels) < 2 or float(np.diff(levels).min()) > COARSE_SIGMAS * sigma
    return coarse >= 2
