"""The way from rest to rest that takes least gas within a given time: push, coast, push against it.

For s'' = u + g with |u| <= U and cost the integral of |u|, the switching function of the minimum principle
is linear in time, so u is +U, 0, -U in that order (M. Athans, P. L. Falb, Optimal Control, 1966, chapter 8,
the fuel-optimal double integrator; g is the table's pull along the way). Where the time is so long that the
pull alone must be paid for, every u of one sign costs |g| T and none costs less (the singular case): then
the way is driven at an even speed between a push and a stretch that the slope speeds up or slows down.
"""

import math
from typing import NamedTuple

from groundstation.control.state import Vector2

_LEVEL = 1e-4  # of the push: a smaller pull is none
_HALVINGS = 50


class Phases(NamedTuple):
    """Three spans of constant acceleration along a way, from rest: accelerations (m/s^2), lengths (s)."""

    accelerations_m_s2: tuple[float, float, float]
    spans_s: tuple[float, float, float]

    @property
    def duration_s(self) -> float:
        """From rest to rest."""
        return math.fsum(self.spans_s)

    def at(self, t_s: float) -> tuple[float, float, float]:
        """Way, speed and acceleration at a moment; at rest after the end."""
        way = speed = 0.0
        for acceleration, span_s in zip(self.accelerations_m_s2, self.spans_s, strict=True):
            part_s = min(t_s, span_s)
            way += (speed + 0.5 * acceleration * part_s) * part_s
            speed += acceleration * part_s
            if t_s <= span_s:
                return way, speed, acceleration
            t_s -= span_s
        return way, 0.0, 0.0


def fastest(distance_m: float, push_m_s2: float, pull_m_s2: float) -> Phases:
    """Bang-bang: accelerate all the way to where braking must begin."""
    up, down = push_m_s2 + pull_m_s2, push_m_s2 - pull_m_s2
    speed = math.sqrt(2.0 * distance_m * up * down / (up + down))
    return Phases((up, 0.0, -down), (speed / up, 0.0, speed / down))


def least_gas(distance_m: float, duration_s: float, push_m_s2: float, pull_m_s2: float) -> Phases:
    """The way of least gas that takes `duration_s`, or the fastest where that is too short.

    Args:
        distance_m: From rest to rest, above 0.
        duration_s: Time for it.
        push_m_s2: Largest acceleration by the valves, either way; above the pull's size.
        pull_m_s2: Of the table, along the way.

    Raises:
        ValueError: The pull is not smaller than the push.
    """
    if not abs(pull_m_s2) < push_m_s2:
        raise ValueError(f"valves that push {push_m_s2} m/s^2 cannot hold against {pull_m_s2} m/s^2")
    quickest = fastest(distance_m, push_m_s2, pull_m_s2)
    if duration_s <= quickest.duration_s:
        return quickest
    if abs(pull_m_s2) <= _LEVEL * push_m_s2:
        return _even(distance_m, duration_s, push_m_s2, push_m_s2) or quickest
    slow, fast = abs(pull_m_s2), push_m_s2 - abs(pull_m_s2)
    up, down = (fast, slow) if pull_m_s2 < 0.0 else (slow, fast)
    return _even(distance_m, duration_s, up, down) or _free(distance_m, duration_s, push_m_s2, pull_m_s2)


def _even(distance_m: float, duration_s: float, up: float, down: float) -> Phases | None:
    """At an even speed between speeding up and slowing down; None where the time is too short."""
    ramps = 0.5 / up + 0.5 / down  # their way is ramps v^2, their time 2 ramps v
    inside = duration_s**2 - 4.0 * ramps * distance_m
    if inside < 0.0:
        return None
    speed = 2.0 * distance_m / (duration_s + math.sqrt(inside))
    return Phases((up, 0.0, -down), (speed / up, duration_s - 2.0 * ramps * speed, speed / down))


def _free(distance_m: float, duration_s: float, push: float, pull: float) -> Phases:
    """Push, glide with the slope, push against it; the speed that the push ends with is found by halving."""
    up, down = push + pull, push - pull

    def phases(speed: float) -> Phases:
        # way of the three spans: v^2 / 2 up + (w^2 - v^2) / 2 pull + w^2 / 2 down
        squared = (2.0 * distance_m - speed**2 / up + speed**2 / pull) / (1.0 / pull + 1.0 / down)
        end = math.sqrt(max(squared, 0.0))
        return Phases((up, pull, -down), (speed / up, max((end - speed) / pull, 0.0), end / down))

    high = fastest(distance_m, push, pull).spans_s[0] * up
    # uphill the glide must not end before the goal
    low = 0.0 if pull > 0.0 else math.sqrt(2.0 * distance_m / (1.0 / up - 1.0 / pull))
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if phases(middle).duration_s > duration_s:
            low = middle
        else:
            high = middle
    return phases(high)


class CoastingWay:
    """A planned straight way, stepped through like a `PointReference`."""

    def __init__(self, start: Vector2, goal: Vector2, phases: Phases) -> None:
        length = math.dist(start, goal)
        self._direction = ((goal[0] - start[0]) / length, (goal[1] - start[1]) / length)
        self._start, self._phases, self._t_s = start, phases, 0.0
        self.goal = goal
        self.position = start
        self.velocity: Vector2 = (0.0, 0.0)
        self.acceleration: Vector2 = (0.0, 0.0)
        self.is_at_goal = False

    def advance(self, dt_s: float) -> None:
        """Move on by one step; the acceleration is the mean over it, which is what pulses can follow."""
        before = self.velocity
        self._t_s += dt_s
        way, speed, _ = self._phases.at(self._t_s)
        x, y = self._direction
        self.is_at_goal = self._t_s >= self._phases.duration_s
        self.position = self.goal if self.is_at_goal else (self._start[0] + way * x, self._start[1] + way * y)
        self.velocity = (speed * x, speed * y)
        self.acceleration = ((self.velocity[0] - before[0]) / dt_s, (self.velocity[1] - before[1]) / dt_s)
