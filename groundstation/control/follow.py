"""Leader and follower: a constant distance to another mock-up, and a constant orientation toward it.

The published formation (Bindel and others): the follower keeps its distance and faces its leader. Three
variants of where it stands: at the bearing at which it happens to be (free), at a bearing of the table, or at
one that turns with the leader.
"""

import math
from collections.abc import Mapping
from typing import Literal

from pydantic import ConfigDict, Field, model_validator

from groundstation.control.at_setpoint import AtSetpoint
from groundstation.control.go_to import GoToConfig
from groundstation.control.keep_in import KeepIn
from groundstation.control.motion_watch import Acceleration
from groundstation.control.state import ControlState, Goal, Vector2
from groundstation.control.vehicle import NEAREST_M, VehicleModel
from groundstation.files.plain_model import PlainModel

WIDER_M, WIDENING_S = 0.15, 3.0
"""A silent leader is given so much more room, over so long; then the place is held."""


class FollowConfig(PlainModel):
    """Whom to follow, and how.

    Attributes:
        leader: Name of the other mock-up.
        distance_m: Between the origins of the two bodies.
        bearing: ``free``; ``table`` or ``leader``: ``bearing_deg`` counts from that frame's +x.
        bearing_deg: Direction from the leader to the follower, counter-clockwise.
        face: Body +x points at the leader; otherwise the heading is that of the goal.
        go_to: How to get there.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    leader: str
    distance_m: float = Field(ge=NEAREST_M, le=100.0)
    bearing: Literal["free", "table", "leader"] = "free"
    bearing_deg: float | None = Field(default=None, ge=-360.0, le=360.0)
    face: bool = True
    go_to: GoToConfig = GoToConfig()

    @model_validator(mode="after")
    def _has_its_bearing(self) -> "FollowConfig":
        if self.bearing != "free" and self.bearing_deg is None:
            raise ValueError(f"bearing = {self.bearing!r} needs bearing_deg")
        if self.bearing == "free" and self.bearing_deg is not None:
            raise ValueError("bearing_deg goes with bearing = 'table' or 'leader'")
        return self


class Follow(AtSetpoint):
    """Controller row ``follow``."""

    def __init__(self, config: FollowConfig, vehicle: VehicleModel, keep_in: KeepIn | None = None) -> None:
        super().__init__(config.go_to, vehicle, keep_in)
        self._config = config

    def reset(self) -> None:
        """See `AtSetpoint.reset`."""
        super().reset()
        self._last_m: Vector2 | None = None
        self._silent_s = 0.0

    def wanted(self, state: ControlState, goal: Goal, neighbours: Mapping[str, ControlState]) -> Goal | None:
        """The place beside the leader; None while the leader is silent."""
        leader = neighbours.get(self._config.leader)
        if leader is None:
            return self._away_from_where_it_was(goal)
        self._last_m, self._silent_s = leader.bounded().position_table_m, 0.0
        return self._beside(leader.bounded(), state, goal)

    def _away_from_where_it_was(self, goal: Goal) -> Goal | None:
        """A leader that is silent may be anywhere near: the distance widens for a while, then it is held."""
        held = self.setpoint(goal)
        self._silent_s += self.span_s
        if self._last_m is None or self._silent_s > WIDENING_S:
            return None
        x, y = self._last_m
        away = (held.position_table_m[0] - x, held.position_table_m[1] - y)
        length_m = max(math.hypot(*away), NEAREST_M)
        wide_m = self._config.distance_m + WIDER_M * self._silent_s / WIDENING_S
        place = (x + away[0] * wide_m / length_m, y + away[1] * wide_m / length_m)
        speed = _scaled(away, WIDER_M / WIDENING_S / length_m)
        return Goal(place, held.heading_rad, speed)

    def _beside(self, leader: ControlState, state: ControlState, goal: Goal) -> Goal:
        """Pose, velocity and acceleration of the place that is to be kept."""
        (x, y), speed = leader.position_table_m, leader.velocity_table_m_s
        push = self.acceleration_of(self._config.leader)
        away = (state.position_table_m[0] - x, state.position_table_m[1] - y)
        own = state.velocity_table_m_s
        drift = (own[0] - speed[0], own[1] - speed[1])
        if self._config.bearing == "free":
            arm, velocity, acceleration = self._along(away, drift, speed, push)
        else:
            arm, velocity, acceleration = self._carried(leader, push)
        heading_rad, rate_rad_s, turn_rad_s2 = goal.heading_rad, 0.0, 0.0
        if self._config.face:
            heading_rad = math.atan2(-away[1], -away[0])
            # the bearing b of the line between them: r^2 b' = r x v, r^2 b'' = r x a - 2 b' (r . v)
            squared = max(_dot(away, away), NEAREST_M**2)
            pull = (acceleration[0] - push.table_m_s2[0], acceleration[1] - push.table_m_s2[1])
            rate_rad_s = _cross(away, drift) / squared
            turn_rad_s2 = (_cross(away, pull) - 2.0 * rate_rad_s * _dot(away, drift)) / squared
        place = (x + arm[0], y + arm[1])
        return Goal(place, heading_rad, velocity, rate_rad_s, acceleration, turn_rad_s2)

    def _along(
        self, away: Vector2, drift: Vector2, speed: Vector2, push: Acceleration
    ) -> tuple[Vector2, Vector2, Vector2]:
        """Arm, velocity and acceleration of the nearest place at the distance.

        Only what brings the place nearer or farther counts: across, it comes along with the follower. In
        polar coordinates about the leader r'' = a_r + w^2 / r, with w the relative speed across, so holding
        r takes a_r = (leader's a)_r - w^2 / r: passing at 6 cm/s and 0.8 m this is 4.5 mm/s^2.
        """
        distance_m = self._config.distance_m
        bearing_rad = math.atan2(away[1], away[0])  # on top of each other: any
        along = (math.cos(bearing_rad), math.sin(bearing_rad))
        across = _cross(along, drift)
        radial = _dot(push.table_m_s2, along) - across**2 / max(math.hypot(*away), NEAREST_M)
        return _scaled(along, distance_m), _scaled(along, _dot(speed, along)), _scaled(along, radial)

    def _carried(self, leader: ControlState, push: Acceleration) -> tuple[Vector2, Vector2, Vector2]:
        """The same at a bearing of the table, or at one that turns with the leader."""
        bearing_rad, rate_rad_s, turn_rad_s2 = math.radians(self._config.bearing_deg or 0.0), 0.0, 0.0
        if self._config.bearing == "leader":
            bearing_rad += leader.heading_rad
            rate_rad_s, turn_rad_s2 = leader.rate_rad_s, push.turn_rad_s2
        arm = _scaled((math.cos(bearing_rad), math.sin(bearing_rad)), self._config.distance_m)
        (speed_x, speed_y), (push_x, push_y) = leader.velocity_table_m_s, push.table_m_s2
        velocity = (speed_x - rate_rad_s * arm[1], speed_y + rate_rad_s * arm[0])
        acceleration = (
            push_x - turn_rad_s2 * arm[1] - rate_rad_s**2 * arm[0],
            push_y + turn_rad_s2 * arm[0] - rate_rad_s**2 * arm[1],
        )
        return arm, velocity, acceleration


def _dot(a: Vector2, b: Vector2) -> float:
    return a[0] * b[0] + a[1] * b[1]


def _cross(a: Vector2, b: Vector2) -> float:
    return a[0] * b[1] - a[1] * b[0]


def _scaled(vector: Vector2, by: float) -> Vector2:
    return vector[0] * by, vector[1] * by
