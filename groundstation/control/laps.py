"""Round after round on a closed curve: to its nearest point, then along it at an even speed.

Along the curve velocity and acceleration are known in closed form: v along the way, v^2 times the curvature
across.
"""

import math

from groundstation.control.curves import Curve, CurvePoint, sampled
from groundstation.control.reference import MotionLimits, PointReference
from groundstation.control.state import Vector2


class Laps:
    """Steps through a curve like a `PointReference` through a straight way.

    Args:
        curve: To be driven.
        limits: Of speed and acceleration.
        position: Where it begins (table, m).
        velocity: With what velocity (m/s).
    """

    def __init__(self, curve: Curve, limits: MotionLimits, position: Vector2, velocity: Vector2) -> None:
        self._curve, self._limits = curve, limits
        points = sampled(curve)
        nearest = min(range(len(points)), key=lambda k: math.dist(points[k].position_table_m, position))
        self._way_m = curve.length_m * nearest / len(points)
        self._speed_m_s = 0.0
        self._first: PointReference | None = PointReference(limits, position, velocity)
        self.position, self.velocity = position, velocity
        self.acceleration: Vector2 = (0.0, 0.0)
        self.point: CurvePoint = curve.at(self._way_m)

    @property
    def rate_rad_s(self) -> float:
        """How fast the direction of travel turns."""
        return self._speed_m_s * self.point.curvature_per_m

    def advance(self, dt_s: float) -> None:
        """Move on by one step."""
        if self._first is not None:
            self._first.advance(self.point.position_table_m, (0.0, 0.0), dt_s)
            first = self._first
            self.position, self.velocity, self.acceleration = (
                first.position,
                first.velocity,
                first.acceleration,
            )
            if first.is_at_goal:
                self._first = None
            return
        gained = min(self._limits.speed - self._speed_m_s, self._limits.acceleration * dt_s)
        self._way_m += (self._speed_m_s + 0.5 * gained) * dt_s
        self._speed_m_s += gained
        self.point = self._curve.at(self._way_m)
        along = (math.cos(self.point.direction_rad), math.sin(self.point.direction_rad))
        across = self._speed_m_s**2 * self.point.curvature_per_m
        faster = gained / dt_s
        self.position = self.point.position_table_m
        self.velocity = (self._speed_m_s * along[0], self._speed_m_s * along[1])
        self.acceleration = (
            faster * along[0] - across * along[1],
            faster * along[1] + across * along[0],
        )
