"""Leader and follower: a constant distance to another mock-up, and a constant orientation toward it.

The published formation (Bindel and others): the follower keeps its distance and faces its leader. Three
variants of where it stands: at the bearing at which it happens to be (free), at a bearing of the table, or at
one that turns with the leader.
"""

import math
from collections.abc import Mapping
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from groundstation.control.at_setpoint import AtSetpoint
from groundstation.control.go_to import GoToConfig
from groundstation.control.keep_in import KeepIn
from groundstation.control.state import ControlState, Goal
from groundstation.control.vehicle import NEAREST_M, VehicleModel


class FollowConfig(BaseModel):
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

    def wanted(self, state: ControlState, goal: Goal, neighbours: Mapping[str, ControlState]) -> Goal | None:
        """The place beside the leader; None while the leader is silent."""
        leader = neighbours.get(self._config.leader)
        return None if leader is None else self._beside(leader.bounded(), state, goal)

    def _beside(self, leader: ControlState, state: ControlState, goal: Goal) -> Goal:
        """Pose and velocity of the place that is to be kept."""
        (x, y), (speed_x, speed_y) = leader.position_table_m, leader.velocity_table_m_s
        away = (state.position_table_m[0] - x, state.position_table_m[1] - y)
        bearing_rad, turning_rad_s = math.radians(self._config.bearing_deg or 0.0), 0.0
        if self._config.bearing == "leader":
            bearing_rad += leader.heading_rad
            turning_rad_s = leader.rate_rad_s
        elif self._config.bearing == "free":
            bearing_rad = math.atan2(away[1], away[0])  # on top of each other: any
        arm = (
            self._config.distance_m * math.cos(bearing_rad),
            self._config.distance_m * math.sin(bearing_rad),
        )
        velocity = (speed_x - turning_rad_s * arm[1], speed_y + turning_rad_s * arm[0])
        if self._config.bearing == "free":
            # only what brings it nearer or farther: across, the place comes along with the follower
            along = (velocity[0] * arm[0] + velocity[1] * arm[1]) / self._config.distance_m**2
            velocity = (along * arm[0], along * arm[1])
        heading_rad, rate_rad_s = goal.heading_rad, 0.0
        if self._config.face:
            heading_rad = math.atan2(-away[1], -away[0])
            relative = (speed_x - state.velocity_table_m_s[0], speed_y - state.velocity_table_m_s[1])
            squared = max(away[0] ** 2 + away[1] ** 2, NEAREST_M**2)
            rate_rad_s = (-away[0] * relative[1] + away[1] * relative[0]) / squared
        return Goal((x + arm[0], y + arm[1]), heading_rad, velocity, rate_rad_s)
