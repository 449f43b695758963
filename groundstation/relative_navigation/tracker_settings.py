"""What a tracker is told before the first frame."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.matching import Centres
from groundstation.relative_navigation.motion import CameraCraft
from groundstation.relative_navigation.pinhole import PinholeCamera
from groundstation.relative_navigation.pose import Pose
from groundstation.relative_navigation.target import Target

Floats = NDArray[np.float64]

GUESS_TURN_RAD, GUESS_SHARE = 0.2, 0.07
"""One sigma of a first guess: of its turn, and of its position as a share of the distance."""


@dataclass(frozen=True, slots=True, eq=False)
class TrackerSettings:
    """A case.

    Attributes:
        camera: The camera.
        target: What it looks at.
        guess: A rough pose of the body in the first frame; None: it is searched for.
        reach_px: The published neighbourhood epsilon; None: as wide as the prediction is uncertain.
        craft: What carries the camera.
        seed: Of searches that draw at random.
    """

    camera: PinholeCamera
    target: Target
    guess: Pose | None = None
    reach_px: float | None = None
    craft: CameraCraft = field(default_factory=CameraCraft)
    seed: int = 0

    @property
    def guess_of_mass(self) -> Pose | None:
        """The guess, of the centre of mass."""
        return None if self.guess is None else self.guess.shifted(self.target.offset_m)

    def guess_covariance(self) -> Floats:
        """Covariance (6, 6) of the guess."""
        distance = 0.0 if self.guess is None else float(np.linalg.norm(self.guess.position_camera_m))
        return np.diag([(GUESS_SHARE * distance) ** 2] * 3 + [GUESS_TURN_RAD**2] * 3)


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """What a frame shows.

    Attributes:
        number: For people.
        t_s: Middle of its exposure.
        centres: What was found in it.
    """

    number: int
    t_s: float
    centres: Centres
