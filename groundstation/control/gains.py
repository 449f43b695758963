"""Feedback gains of a double integrator that minimise a quadratic cost.

For x'' = u with cost integral of (x/X)^2 + (x'/V)^2 + (u/U)^2 the Riccati equation has the closed solution
u = -(U/X) x - sqrt(2 U/X + (U/V)^2) x' (A. Bryson, Y.-C. Ho, Applied Optimal Control, 1975, section 5.2, with
their rule of weighting each variable by its largest acceptable value).
"""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class AxisGains:
    """Acceleration per error of one axis: ``stiffness_per_s2`` on position, ``damping_per_s`` on velocity."""

    stiffness_per_s2: float
    damping_per_s: float


def lqr_gains(error: float, acceleration: float, speed: float = math.inf) -> AxisGains:
    """Gains for one axis; metres or radians throughout.

    Args:
        error: Position error that is worth `acceleration`.
        acceleration: Control acceleration that is acceptable.
        speed: Velocity error that is worth `acceleration`; infinite leaves it free.

    Raises:
        ValueError: An argument is not positive.
    """
    if not (error > 0.0 and acceleration > 0.0 and speed > 0.0):
        raise ValueError(f"gains need positive weights, found {error}, {acceleration}, {speed}")
    stiffness = acceleration / error
    return AxisGains(stiffness, math.sqrt(2.0 * stiffness + (acceleration / speed) ** 2))
