"""Places that are too near to another mock-up: where it is, and where it is sent. Pure."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

from groundstation.control.state import Vector2
from groundstation.control.surroundings import Obstacle
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


def in_the_way(position_table_m: Vector2, obstacles: Iterable[Obstacle]) -> str:
    """Why a mock-up cannot be at a place for what stands on the table; empty if it can."""
    for obstacle in obstacles:
        least_m = 0.5 * NEAREST_M + obstacle.radius_m
        apart_m = math.dist(position_table_m, obstacle.position_table_m)
        if apart_m < least_m:
            return f"{obstacle.name} is {apart_m:.2f} m from there, {least_m:g} m are asked for"
    return ""


@dataclass(slots=True)
class Others:
    """What is known of the other mock-ups, however old: who has fallen silent still stands somewhere.

    Attributes:
        positions_table_m: Of the newest states, by name.
        goals_table_m: Where their controllers take them, by name.
        obstacles: What stands on the table.
    """

    positions_table_m: dict[str, Vector2] = field(default_factory=dict)
    goals_table_m: dict[str, Vector2] = field(default_factory=dict)
    obstacles: tuple[Obstacle, ...] = ()

    def objection(self, goal_table_m: Vector2) -> str:
        """Why a mock-up is not sent to a place; empty if it may be."""
        refusal = in_the_way(goal_table_m, self.obstacles)
        if refusal:
            return refusal
        for name, position_m in self.positions_table_m.items():
            refusal = too_near(name, math.dist(position_m, goal_table_m), relation="from there")
            if refusal:
                return refusal
        for name, other_m in self.goals_table_m.items():
            refusal = too_near(f"the goal of {name}", math.dist(other_m, goal_table_m), relation="from there")
            if refusal:
                return refusal
        return ""
