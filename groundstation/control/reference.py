"""Trajectory to a pose, one step at a time: accelerate, cruise, brake, within speed and acceleration.

At each step the reference wants the largest speed towards the goal from which it can still stop there, and
changes its velocity as fast as allowed. From rest this is the time-optimal trapezoid on a straight line; with
any other velocity, or a goal that moves or is changed on the way, it bends towards the same line. Positions
and velocities are relative to the goal, so that a goal of constant velocity is met without lag.
"""

import math
from dataclasses import dataclass

from groundstation.control.state import Vector2, limit_length

_BRAKING_SHARE = 0.9  # of the acceleration: what is left corrects the last steps
_ARRIVAL_SHARE = 0.1  # of the capture distance and its speed: a step that station keeping does not notice


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """Largest speed and acceleration of a reference, in metres or radians.

    A goal that was reached and then jumps by less than `capture` is taken over at once: a neighbour's
    estimate jumps by millimetres at each star fix, and planning a way across each jump would only shake the
    valves. ``braking`` is the largest deceleration, where it is another one than the acceleration (a slope).
    """

    speed: float
    acceleration: float
    capture: float = 0.0
    braking: float | None = None


def approach_speed(distance: float, acceleration: float, dt_s: float) -> float:
    """Largest speed from which steps of `dt_s` can still stop within `distance`.

    The sampled form of sqrt(2 a d): braking by a dt a step, the way to rest from speed v is
    v (v / (a dt) + 1) dt / 2, solved for v (the discrete time-optimal tracking differentiator of J. Han, From
    PID to Active Disturbance Rejection Control, IEEE Trans. Ind. Electron. 56(3), 2009, section II).
    """
    step = acceleration * dt_s
    return step * (math.sqrt(0.25 + 2.0 * distance / (step * dt_s)) - 0.5)


class PointReference:
    """Position, velocity and acceleration that lead to a goal; heading is the same with y = 0."""

    def __init__(self, limits: MotionLimits, position: Vector2, velocity: Vector2) -> None:
        self.limits = limits
        self.position = position
        self.velocity = limit_length(velocity, limits.speed)
        self.acceleration: Vector2 = (0.0, 0.0)
        self.is_at_goal = False

    def advance(self, goal: Vector2, goal_velocity: Vector2, dt_s: float) -> None:
        """Move by one step towards a goal that will be at `goal` when the step ends."""
        limits = self.limits
        # the goal where it was when the step began: there the relative motion is judged
        begun = (goal[0] - goal_velocity[0] * dt_s, goal[1] - goal_velocity[1] * dt_s)
        way = (begun[0] - self.position[0], begun[1] - self.position[1])
        distance = math.hypot(*way)
        relative = (self.velocity[0] - goal_velocity[0], self.velocity[1] - goal_velocity[1])
        step = limits.acceleration * dt_s
        # hysteresis: arriving needs a tenth of what losing a reached goal does
        share = 1.0 if self.is_at_goal else _ARRIVAL_SHARE
        capture = share * limits.capture
        reach = max(step, share * math.sqrt(2.0 * limits.acceleration * limits.capture))
        if distance <= max(capture, 0.5 * step * dt_s) and math.hypot(*relative) <= reach:
            self._arrive(goal, goal_velocity, dt_s)
            return
        self.is_at_goal = False
        braking = _BRAKING_SHARE * limits.acceleration if limits.braking is None else limits.braking
        speed = min(approach_speed(distance, braking, dt_s), limits.speed)
        # never beyond the goal within this step
        speed = min(speed, distance / dt_s)
        heading = (way[0] / distance, way[1] / distance) if distance > 0.0 else (0.0, 0.0)
        wanted = limit_length(
            (speed * heading[0] + goal_velocity[0], speed * heading[1] + goal_velocity[1]), limits.speed
        )
        if math.hypot(*wanted) < math.hypot(*self.velocity):
            step = max(step, braking * dt_s)
        change = limit_length((wanted[0] - self.velocity[0], wanted[1] - self.velocity[1]), step)
        self.velocity = (self.velocity[0] + change[0], self.velocity[1] + change[1])
        self.acceleration = (change[0] / dt_s, change[1] / dt_s)
        self.position = (
            self.position[0] + self.velocity[0] * dt_s,
            self.position[1] + self.velocity[1] * dt_s,
        )

    def _arrive(self, goal: Vector2, goal_velocity: Vector2, dt_s: float) -> None:
        if self.is_at_goal:
            self.acceleration = (0.0, 0.0)
        else:  # the last of the braking
            change = (goal_velocity[0] - self.velocity[0], goal_velocity[1] - self.velocity[1])
            self.acceleration = (change[0] / dt_s, change[1] / dt_s)
        self.is_at_goal = True
        self.position, self.velocity = goal, goal_velocity
