"""Ways of several ships at once that nobody meets on: what is asked for, what is kept to, what comes out.

`planning` makes them by sequential convex programming (`convex_rounds`); what comes out is looked at between
the moments of the programme, too (`trajectory_check`), and refused in a sentence where it could not be made
safe.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import BSpline

from groundstation.control.keep_in import KeepIn
from groundstation.control.spline import Array, RestToRest
from groundstation.control.state import Vector2


class NoSafeWayError(ValueError):
    """No plan was found that is safe; the text is one sentence."""


@dataclass(frozen=True, slots=True)
class Margins:
    """What a plan keeps to.

    Attributes:
        radius_m: Of a hull.
        gap_m: Between two hulls, and between a hull and an obstacle.
        stopping_gap_m: What would be left of it if all began to brake at that moment.
        edge_gap_m: From the centre's region to its edge after braking, for who flies towards it.
        speed_m_s: Largest speed.
        acceleration_m_s2: Largest acceleration: a share of what the valves give, the rest is reserve.
        braking_m_s2: What to count on for stopping.
        reaction_s: Before braking begins, with all that the safety filter adds to it.
    """

    radius_m: float = 0.2
    gap_m: float = 0.12
    stopping_gap_m: float = 0.04
    edge_gap_m: float = 0.04
    speed_m_s: float = 0.10
    acceleration_m_s2: float = 0.015
    braking_m_s2: float = 0.025
    reaction_s: float = 2.0


@dataclass(frozen=True, slots=True)
class Reconfiguration:
    """From where to where; hashable, so that a plan is made once for all who ask.

    Attributes:
        starts_m: Of each ship, table frame.
        goals_m: Of each ship.
        keep_in: Region for the centres; None where there is none.
        obstacles_m: x, y, radius of each.
        margins: What is kept to.
        duration_s: From rest to rest; None chooses one by speed and acceleration.
    """

    starts_m: tuple[Vector2, ...]
    goals_m: tuple[Vector2, ...]
    keep_in: KeepIn | None = None
    obstacles_m: tuple[tuple[float, float, float], ...] = ()
    margins: Margins = Margins()
    duration_s: float | None = None


@dataclass(frozen=True, eq=False)
class Plan:
    """Ways of all ships.

    Attributes:
        family: Of the splines.
        control_m: Control points, shape (ships, count, 2), table frame.
    """

    family: RestToRest
    control_m: Array

    @property
    def duration_s(self) -> float:
        """From rest to rest."""
        return self.family.duration_s

    @cached_property
    def effort(self) -> float:
        """Integral of the accelerations' squares over all ships, m2/s3."""
        return float(np.einsum("ija,jk,ika->", self.control_m, self.family.effort(), self.control_m))

    @cached_property
    def _splines(self) -> tuple[BSpline, ...]:
        """Positions, velocities and accelerations of all ships."""
        return tuple(self.family.spline(np.moveaxis(self.control_m, 0, 1), order) for order in (0, 1, 2))

    def at(self, t_s: float) -> tuple[Array, Array, Array]:
        """Positions, velocities and accelerations at a moment, each of shape (ships, 2).

        At rest before the beginning and after the end.
        """
        inside_s = min(max(t_s, 0.0), self.duration_s)
        position, velocity, acceleration = (spline(inside_s) for spline in self._splines)
        return position, velocity, acceleration

    def sampled(self, t_s: Array, order: int = 0) -> Array:
        """Positions, velocities or accelerations at moments, shape (n, ships, 2)."""
        values: Array = self._splines[order](t_s)
        return values


def shortest_s(asked: Reconfiguration) -> float:
    """A duration that the longest way fits into, with room for a detour."""
    margins = asked.margins
    ways_m = [math.dist(start, goal) for start, goal in zip(asked.starts_m, asked.goals_m, strict=True)]
    longest_m = max(ways_m, default=0.0)
    return max(
        2.0 * longest_m / margins.speed_m_s, math.sqrt(9.0 * longest_m / margins.acceleration_m_s2), 1.0
    )
