"""The craft that carries the camera, and what a motion's errors are.

The camera's craft and how it is turned come from outside. A case without them is seen by a camera that floats
without turning: the orbital frame is then the camera's and its rate zero, so that the other craft goes
straight on but for an acceleration that the filter learns, and there is no gravity gradient.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
AttitudeOfTime = Callable[[float], Floats]
"""Seconds to ``camera_from_orbital``, (3, 3)."""

STATE = 15
"""Errors of a motion: position in camera axes, turn about camera axes, velocity in orbital axes, rate in body
axes, acceleration in orbital axes."""
POSITION, TURN, VELOCITY, RATE, ACCELERATION = (slice(i, i + 3) for i in range(0, STATE, 3))


_EYE = np.eye(3)


def _fixed(_t_s: float) -> Floats:
    return _EYE


@dataclass(frozen=True, slots=True, eq=False)
class CameraCraft:
    """The craft that carries the camera.

    Attributes:
        orbital_rate_rad_s: Of its orbit; 0: no orbit is known.
        camera_from_orbital: How the camera is turned at a time.
        camera_from_mass_m: Place of the optical centre, camera axes, counted from the craft's centre of
            mass, (3,).
    """

    orbital_rate_rad_s: float = 0.0
    camera_from_orbital: AttitudeOfTime = _fixed
    camera_from_mass_m: Floats = field(default_factory=lambda: np.zeros(3))

    def turned_by(self, begin_s: float, end_s: float) -> Floats:
        """Return the camera's axes at the end from those at the beginning, as inertial space sees them."""
        angle = self.orbital_rate_rad_s * (end_s - begin_s)
        c, s = np.cos(angle), np.sin(angle)
        back = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        found: Floats = self.camera_from_orbital(end_s) @ back @ self.camera_from_orbital(begin_s).T
        return found
