"""Where a vehicle is sent so that a calibration sees enough: turns on the spot, and flights to and fro."""

from __future__ import annotations

import math

from groundstation.control.keep_in import KeepIn

Pose = tuple[float, float, float]
"""x, y (m), heading (rad)."""

TURN_DEG = 120.0
ROUND_TRIP: tuple[Pose, ...] = (
    (0.3, 0.0, 0.0),
    (-0.3, 0.2, math.pi / 2),
    (0.2, -0.3, math.pi),
    (0.0, 0.3, -math.pi / 2),
)
"""From where the vehicle hovers."""
TOUR: tuple[Pose, ...] = (
    (0.5, 0.3, 2.0),
    (-0.5, -0.2, -1.2),
    (0.1, 0.4, 0.6),
    (-0.4, 0.1, 2.8),
    (0.4, -0.4, -2.2),
    (-0.1, 0.2, 1.1),
    (0.3, 0.0, -0.5),
)
"""Goals from where it hovers: each leg pushes along both axes and turns."""
_INWARD = 0.01
"""Share of the way to the middle of the table that a goal on the boundary is moved: rounding."""


def turn(number: int, home: Pose) -> Pose:
    """The goal of a number: three thirds of a turn forth, and three back."""
    place = number % 6
    thirds = place + 1 if place < 3 else 5 - place
    return home[0], home[1], home[2] + math.radians(TURN_DEG) * thirds


def push(number: int, home: Pose) -> Pose:
    """The goal of a number, to and fro along both axes."""
    x_m, y_m, turn_rad = ROUND_TRIP[number % len(ROUND_TRIP)]
    return home[0] + x_m, home[1] + y_m, home[2] + turn_rad


def tour(number: int, home: Pose) -> Pose:
    """The goal of a number, over the table with turns."""
    x_m, y_m, turn_rad = TOUR[number % len(TOUR)]
    return home[0] + x_m, home[1] + y_m, home[2] + turn_rad


def inside(goal: Pose, keep_in: KeepIn) -> Pose:
    """The goal itself, or one within the part of the table that vehicles keep to."""
    if min(keep_in.edge_distances_m(goal[:2])) >= 0.0:
        return goal
    corners = keep_in.corners_table_m
    middle = [sum(axis) / len(corners) for axis in zip(*corners, strict=True)]
    x_m, y_m = (
        at + _INWARD * (to - at) for at, to in zip(keep_in.nearest_inside(goal[:2]), middle, strict=True)
    )
    return x_m, y_m, goal[2]
