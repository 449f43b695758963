"""Go to a pose: a reference within speed and acceleration limits, followed by station keeping.

The reference starts where the mock-up is and moves inside the keep-in region, which is convex, so that a
straight way between two of its points stays inside. If the mock-up falls far behind (pushed, valves weak),
the reference starts again from where it is rather than running away.
"""

import math
from collections.abc import Mapping

from pydantic import BaseModel, ConfigDict, Field

from groundstation.control.controller import NO_NEIGHBOURS
from groundstation.control.keep_in import KeepIn
from groundstation.control.reference import MotionLimits, PointReference
from groundstation.control.state import BodyWrench, ControlState, Goal, Vector2
from groundstation.control.station import LONGEST_SPAN_S, StationConfig, StationKeeping
from groundstation.control.vehicle import VehicleModel
from groundstation.frames import wrap_angle


class GoToConfig(BaseModel):
    """Limits of the way, and the law that follows it.

    Attributes:
        speed_m_s: Largest speed of the reference.
        acceleration_m_s2: Largest acceleration; what is left of the valves fights slope and noise.
        capture_m: A reached goal that jumps by less than this is followed at once, without a way.
        restart_error_m: Distance between mock-up and reference that starts the reference anew.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    speed_m_s: float = Field(default=0.10, gt=0.0)
    acceleration_m_s2: float = Field(default=0.020, gt=0.0)
    rate_deg_s: float = Field(default=10.0, gt=0.0)
    angular_acceleration_deg_s2: float = Field(default=5.0, gt=0.0)
    capture_m: float = Field(default=0.02, ge=0.0)
    capture_deg: float = Field(default=2.0, ge=0.0)
    restart_error_m: float = Field(default=0.15, gt=0.0)
    restart_error_deg: float = Field(default=30.0, gt=0.0)
    station: StationConfig = StationConfig()


class GoTo:
    """Controller row ``go_to``."""

    def __init__(self, config: GoToConfig, vehicle: VehicleModel, keep_in: KeepIn | None = None) -> None:
        self._config = config
        self._keep_in = keep_in
        self._station = StationKeeping(config.station, vehicle)
        self._limits = MotionLimits(config.speed_m_s, config.acceleration_m_s2, config.capture_m)
        self._turn_limits = MotionLimits(
            math.radians(config.rate_deg_s),
            math.radians(config.angular_acceleration_deg_s2),
            math.radians(config.capture_deg),
        )
        self._way: PointReference | None = None
        self._turn: PointReference | None = None

    def reset(self) -> None:
        """Forget way and disturbances; the next update starts from the state it gets."""
        self._station.reset()
        self._way = self._turn = None

    @property
    def disturbance_table_m_s2(self) -> Vector2:
        """Acceleration found beyond valves and known slope, (x, y)."""
        return self._station.disturbance_table_m_s2

    def setpoint(self, goal: Goal) -> Goal:
        """The goal itself."""
        return goal

    def update(
        self,
        state: ControlState,
        goal: Goal,
        dt_s: float,
        *,
        applied: BodyWrench | None = None,
        neighbours: Mapping[str, ControlState] = NO_NEIGHBOURS,
    ) -> BodyWrench:
        """See `Controller.update`; neighbours are not looked at."""
        if not (math.isfinite(dt_s) and dt_s > 0.0):
            raise ValueError(f"dt_s must be above 0, found {dt_s}")
        reference = self._reference(state.bounded(), goal.bounded(), min(dt_s, LONGEST_SPAN_S))
        return self._station.update(state, reference, dt_s, applied=applied)

    def _reference(self, state: ControlState, goal: Goal, dt_s: float) -> Goal:
        here, there = state.position_table_m, goal.position_table_m
        if self._keep_in is not None:
            there = self._keep_in.nearest_inside(there)
        way, turn = self._way, self._turn
        if way is None or math.dist(way.position, here) > self._config.restart_error_m:
            way = PointReference(self._limits, here, state.velocity_table_m_s)
        if turn is None or abs(wrap_angle(turn.position[0] - state.heading_rad)) > math.radians(
            self._config.restart_error_deg
        ):
            turn = PointReference(self._turn_limits, (state.heading_rad, 0.0), (state.rate_rad_s, 0.0))
        way.advance(there, goal.velocity_table_m_s, dt_s)
        # the shorter way round: the goal on the branch of the reference
        aim_rad = turn.position[0] + wrap_angle(goal.heading_rad - turn.position[0])
        turn.advance((aim_rad, 0.0), (goal.rate_rad_s, 0.0), dt_s)
        self._way, self._turn = way, turn
        return Goal(
            way.position,
            wrap_angle(turn.position[0]),
            way.velocity,
            turn.velocity[0],
            goal.acceleration_table_m_s2 if way.is_at_goal else way.acceleration,
            goal.angular_acceleration_rad_s2 if turn.is_at_goal else turn.acceleration[0],
        )
