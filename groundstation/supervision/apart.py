"""Places that are too near to another mock-up: where it is, and where it is sent. Pure."""

import math
from dataclasses import dataclass, field

from groundstation.control.state import Vector2
from groundstation.control.vehicle import NEAREST_M


def too_near(name: str, apart_m: float, *, relation: str = "away") -> str:
    """Why a distance between two mock-ups is refused; empty where it is not.

    Args:
        name: The other one, or what of it is near.
        apart_m: Between the centres.
        relation: ``away``, or ``from there``.
    """
    if apart_m >= NEAREST_M:
        return ""
    return f"{name} is {apart_m:.2f} m {relation}, {NEAREST_M:g} m are asked for"


@dataclass(slots=True)
class Others:
    """What is known of the other mock-ups, however old: who has fallen silent still stands somewhere.

    Attributes:
        positions_table_m: Of the newest states, by name.
        goals_table_m: Where their controllers take them, by name.
    """

    positions_table_m: dict[str, Vector2] = field(default_factory=dict)
    goals_table_m: dict[str, Vector2] = field(default_factory=dict)

    def objection(self, goal_table_m: Vector2) -> str:
        """Why a mock-up is not sent to a place; empty if it may be."""
        for name, position_m in self.positions_table_m.items():
            refusal = too_near(name, math.dist(position_m, goal_table_m), relation="from there")
            if refusal:
                return refusal
        for name, other_m in self.goals_table_m.items():
            refusal = too_near(f"the goal of {name}", math.dist(other_m, goal_table_m), relation="from there")
            if refusal:
                return refusal
        return ""
