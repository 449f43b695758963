"""A pose with covariance, and what a frame shows of a target."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.rotations import quaternion_of, rotation_vector, turn

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """Where a body is and how it is turned, camera axes.

    Attributes:
        camera_from_body: (3, 3).
        position_camera_m: Of the body's origin, (3,).
    """

    camera_from_body: Floats
    position_camera_m: Floats

    @property
    def quaternion(self) -> Floats:
        """Unit quaternion (4,) of ``camera_from_body``, scalar first and not negative."""
        return quaternion_of(self.camera_from_body)

    def moved(self, step: Floats) -> "Pose":
        """Return the pose with errors (6,) added: position m, turn about camera axes rad."""
        return Pose(turn(step[3:]) @ self.camera_from_body, self.position_camera_m + step[:3])

    def minus(self, other: "Pose") -> Floats:
        """Return what `moved` adds to the other pose to give this one, (6,)."""
        step = np.empty(6)
        step[:3] = self.position_camera_m - other.position_camera_m
        step[3:] = rotation_vector(self.camera_from_body @ other.camera_from_body.T)
        return step

    def points_camera_m(self, points_body_m: Floats) -> Floats:
        """Return points (n, 3) of the body in camera axes."""
        found: Floats = points_body_m @ self.camera_from_body.T + self.position_camera_m
        return found

    def shifted(self, offset_body_m: Floats) -> "Pose":
        """Return the pose of the same body with its origin at another of its points (3,)."""
        return Pose(self.camera_from_body, self.position_camera_m + self.camera_from_body @ offset_body_m)


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """Centres of a frame that are known to be points of the target.

    Attributes:
        point: Which points, (k,).
        pixels: Their centres, (k, 2).
        weights: Square roots of inverse covariances, (k, 2, 2): ``weights @ error`` has the covariance 1; or
            a single number 1/sigma for all.
    """

    point: Ints
    pixels: Floats
    weights: Floats | float


@dataclass(frozen=True, slots=True, eq=False)
class PoseFit:
    """What a solver found.

    Attributes:
        pose: Where the sum of squares is least.
        covariance: (6, 6), position m and turn rad in camera axes.
        cost: Sum of squares of whitened residuals: about 2 k - 6 where all is well.
        iterations: How many it took.
        converged: Whether it came to rest.
    """

    pose: Pose
    covariance: Floats
    cost: float
    iterations: int
    converged: bool
