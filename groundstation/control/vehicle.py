"""The mock-up as the controllers know it: mass, inertia, and where its valves push."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.control.state import Vector2

NEAREST_M = 0.45
"""Between the centres of two mock-ups: both bodies, and the way that one drifts first."""
UNIT_TOLERANCE = 1e-6  # rig files are typed by hand: a direction may be off by rounding only


@dataclass(frozen=True, slots=True)
class Valve:
    """One nozzle.

    Attributes:
        position_body_m: Where the force acts, (x, y) from the centre of mass.
        direction_body: Unit vector of the force on the mock-up (opposite to the jet).
        thrust_n: Force while open.

    Raises:
        ValueError: The direction is not of length one or the thrust is not positive.
    """

    position_body_m: Vector2
    direction_body: Vector2
    thrust_n: float

    def __post_init__(self) -> None:
        if abs(float(np.hypot(*self.direction_body)) - 1.0) > UNIT_TOLERANCE:
            raise ValueError(f"a valve's direction must have length 1, found {self.direction_body}")
        if not (np.isfinite(self.thrust_n) and self.thrust_n > 0.0):
            raise ValueError(f"a valve's thrust must be above 0 N, found {self.thrust_n}")


@dataclass(frozen=True, slots=True)
class VehicleModel:
    """Mass properties and valves, as the rig states them.

    Raises:
        ValueError: Mass or inertia is not positive, or there is no valve.
    """

    mass_kg: float
    inertia_kg_m2: float
    valves: tuple[Valve, ...]

    def __post_init__(self) -> None:
        if not (self.mass_kg > 0.0 and self.inertia_kg_m2 > 0.0):
            raise ValueError(
                f"mass and inertia must be above 0, found {self.mass_kg} kg and {self.inertia_kg_m2} kg m2"
            )
        if not self.valves:
            raise ValueError("a vehicle needs valves, found none")

    def effectiveness(self) -> NDArray[np.float64]:
        """Wrench per open valve.

        Returns:
            Shape (3, n): rows force x [N], force y [N] (body), torque [N m]; one column a valve.
        """
        return effectiveness(self.valves)


def effectiveness(valves: Sequence[Valve]) -> NDArray[np.float64]:
    """Columns (force x, force y, torque) of the valves, shape (3, n), body axes."""
    position = np.array([valve.position_body_m for valve in valves], dtype=float)
    force = np.array([np.multiply(valve.direction_body, valve.thrust_n) for valve in valves])
    torque = position[:, 0] * force[:, 1] - position[:, 1] * force[:, 0]
    return np.vstack([force.T, torque])


def square_of_eight(arm_m: float = 0.15, thrust_n: float = 0.22) -> tuple[Valve, ...]:
    """The usual eight valves: a pair on each face, at +arm and -arm, in the order +x, -x, +y, -y.

    Args:
        arm_m: Lever of each valve, also the distance of the face from the centre.
        thrust_n: Force of each valve.
    """
    valves: list[Valve] = []
    for push in ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)):
        for side in (arm_m, -arm_m):
            along_x = push[0] != 0.0
            face = (-push[0] * arm_m, side) if along_x else (side, -push[1] * arm_m)
            valves.append(Valve(face, push, thrust_n))
    return tuple(valves)
