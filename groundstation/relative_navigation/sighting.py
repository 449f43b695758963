"""What one picture of a side camera tells of another mock-up: its place and turn in the own body frame."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.frames import wrap_angle

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """A body that was found.

    Attributes:
        position_body_m: Its origin in the own body frame, (2,).
        heading_rad: Its heading less the own one, in [-pi, pi); NaN where it cannot be seen.
        covariance: Of x, y (m), heading (rad), (3, 3); where the heading cannot be seen its variance is
            infinite and what couples it is 0.
        points: Markers used, or columns of the lit part.
        misfit: Mean square of the residuals over their sigmas: 1 where all is as it should be.
    """

    position_body_m: Floats
    heading_rad: float
    covariance: Floats
    points: int
    misfit: float

    @property
    def range_m(self) -> float:
        """Between the origins of the two bodies."""
        return float(np.hypot(*self.position_body_m))

    @property
    def bearing_rad(self) -> float:
        """Of the other's origin from the own one, from the own body +x, counter-clockwise."""
        return math.atan2(self.position_body_m[1], self.position_body_m[0])


@dataclass(frozen=True, slots=True)
class Unseen:
    """A body that was not found, and why.

    Attributes:
        reason: In words.
        is_ambiguous: Something was found, and it can be understood in two ways.
    """

    reason: str
    is_ambiguous: bool = False


def seen_at(
    position_body_m: Floats, heading_rad: float, covariance: Floats, points: int, misfit: float
) -> Seen:
    """A body that was found, its heading brought to one turn."""
    heading = heading_rad if math.isnan(heading_rad) else wrap_angle(heading_rad)
    return Seen(position_body_m, heading, covariance, points, misfit)
