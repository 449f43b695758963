"""Go to a pose: a reference within speed and acceleration limits, followed by station keeping.

Three profiles. ``limited``: a trapezoid within the stated speed and acceleration. ``time``: as fast as the
valves and the slope allow along this way (`fastest_way`); the last centimetres are braked evenly, so that the
reference ends at the goal. ``gas``: push, coast, push against it, in the stated time (`coasting`).

The reference starts where the mock-up is and moves inside the keep-in region, which is convex, so that a
straight way between two of its points stays inside. If the mock-up falls far behind (pushed, valves weak),
the reference starts again from where it is rather than running away.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Literal

from pydantic import ConfigDict, Field, model_validator

from groundstation.control.authority import Authority, authority_along
from groundstation.control.coasting import CoastingWay, least_gas
from groundstation.control.controller import NO_NEIGHBOURS, span_of
from groundstation.control.fastest_way import BRAKE_SHARE, fastest_acceleration
from groundstation.control.keep_in import KeepIn
from groundstation.control.reference import MotionLimits, PointReference
from groundstation.control.state import BodyWrench, ControlState, Goal, Vector2
from groundstation.control.station import StationConfig, StationKeeping
from groundstation.control.vehicle import VehicleModel
from groundstation.control.wrench_envelope import WrenchEnvelope
from groundstation.files.plain_model import PlainModel
from groundstation.frames import wrap_angle

LEAD_S = 0.1
"""Age of a state and half a period of pulses: the way is judged where the next push finds the mock-up."""
LEAST_SHARE = 0.3
"""Of the brakes, for an even end: a slower one takes too long."""
GAS_SHARE = 0.9
"""For the pushes before and after coasting."""
TURNS_RAD = math.radians(5.0)
"""Who turns more on the way counts on what the valves give in every direction."""
NEARLY_THERE_M = 0.015
"""From here on a fast way is braked evenly to its end, and tracked like any other."""
LEAST_WAY_M, AT_REST_M_S = 0.02, 1e-3
"""A shorter way, or one that begins in motion, is not planned for coasting."""


class GoToConfig(PlainModel):
    """Limits of the way, and the law that follows it.

    Attributes:
        profile: ``limited``, ``time`` or ``gas``.
        duration_s: Of a way of the profile ``gas``; the default is what coasting at `speed_m_s` takes.
        fastest_m_s: Largest speed of the profile ``time``.
        speed_m_s: Largest speed of the reference.
        acceleration_m_s2: Largest acceleration; what is left of the valves fights slope and noise.
        capture_m: A reached goal that jumps by less than this is followed at once, without a way.
        restart_error_m: Distance between mock-up and reference that starts the reference anew.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    profile: Literal["limited", "time", "gas"] = "limited"
    duration_s: float | None = Field(default=None, gt=0.0, le=3600.0)
    fastest_m_s: float = Field(default=0.25, gt=0.0, le=1.0)
    speed_m_s: float = Field(default=0.10, gt=0.0)
    acceleration_m_s2: float = Field(default=0.020, gt=0.0)
    rate_deg_s: float = Field(default=10.0, gt=0.0)
    angular_acceleration_deg_s2: float = Field(default=5.0, gt=0.0)
    capture_m: float = Field(default=0.02, ge=0.0)
    capture_deg: float = Field(default=2.0, ge=0.0)
    restart_error_m: float = Field(default=0.15, gt=0.0)
    restart_error_deg: float = Field(default=30.0, gt=0.0)
    station: StationConfig = StationConfig()

    @model_validator(mode="after")
    def _states_a_time_for_gas_only(self) -> "GoToConfig":
        if self.duration_s is not None and self.profile != "gas":
            raise ValueError("duration_s goes with profile = 'gas'")
        return self


class GoTo:
    """Controller row ``go_to``."""

    def __init__(self, config: GoToConfig, vehicle: VehicleModel, keep_in: KeepIn | None = None) -> None:
        self._config = config
        self._keep_in = keep_in
        self._vehicle, self._envelope = vehicle, WrenchEnvelope(vehicle)
        self._station = StationKeeping(config.station, vehicle)
        self._limits = MotionLimits(config.speed_m_s, config.acceleration_m_s2, config.capture_m)
        self._turn_limits = MotionLimits(
            math.radians(config.rate_deg_s),
            math.radians(config.angular_acceleration_deg_s2),
            math.radians(config.capture_deg),
        )
        self._way: PointReference | CoastingWay | None = None
        self._turn: PointReference | None = None
        self._is_fast = False

    def reset(self) -> None:
        """Forget way and disturbances; the next update starts from the state it gets."""
        self._station.reset()
        self._way = self._turn = None
        self._is_fast = False

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
        reference = self._reference(state.bounded(), goal.bounded(), span_of(dt_s))
        return self._station.update(state, reference, dt_s, applied=applied)

    def _reference(self, state: ControlState, goal: Goal, dt_s: float) -> Goal:
        way, turn = self._moved(state, goal, dt_s), self._turn
        if turn is None or abs(wrap_angle(turn.position[0] - state.heading_rad)) > math.radians(
            self._config.restart_error_deg
        ):
            turn = PointReference(self._turn_limits, (state.heading_rad, 0.0), (state.rate_rad_s, 0.0))
        # the shorter way round: the goal on the branch of the reference
        aim_rad = turn.position[0] + wrap_angle(goal.heading_rad - turn.position[0])
        turn.advance((aim_rad, 0.0), (goal.rate_rad_s, 0.0), dt_s)
        self._way, self._turn = way, turn
        # who has arrived is told the goal's own acceleration, beside the last of the way's braking
        follows = way.is_at_goal and isinstance(way, PointReference)
        its = goal.acceleration_table_m_s2 if follows else (0.0, 0.0)
        return Goal(
            way.position,
            wrap_angle(turn.position[0]),
            way.velocity,
            turn.velocity[0],
            (way.acceleration[0] + its[0], way.acceleration[1] + its[1]),
            turn.acceleration[0] + (goal.angular_acceleration_rad_s2 if turn.is_at_goal else 0.0),
        )

    def _moved(self, state: ControlState, goal: Goal, dt_s: float) -> PointReference | CoastingWay:
        """The way, one step on."""
        here, there, velocity = state.position_table_m, goal.position_table_m, goal.velocity_table_m_s
        if self._keep_in is not None:
            there = self._keep_in.nearest_inside(there)
        way = self._way
        if way is None or math.dist(way.position, here) > self._config.restart_error_m:
            way = PointReference(self._limits, here, state.velocity_table_m_s)
        if self._config.profile == "gas":
            way = self._coasting(way, state, goal, there)
        if isinstance(way, CoastingWay):
            way.advance(dt_s)
            return way
        if self._config.profile == "time" and not way.is_at_goal:
            return self._fastest(way, state, goal, there, dt_s)
        way.advance(there, velocity, dt_s)
        return way

    def _fastest(
        self, way: PointReference, state: ControlState, goal: Goal, there: Vector2, dt_s: float
    ) -> PointReference:
        """The next step at the valves' limits, judged where the next push finds the mock-up.

        The way begins anew there each time: nothing to catch up with, only the acceleration counts. A
        reference that runs ahead of valves which are weaker than stated would brake too late.
        """
        here, its = state.carried(LEAD_S).position_table_m, goal.velocity_table_m_s
        is_near = math.dist(here, there) <= NEARLY_THERE_M
        if is_near and not self._is_fast:
            way.advance(there, its, dt_s)
            return way
        along = self._authority(here, there, state, goal)
        speed = state.velocity_table_m_s
        relative = (speed[0] - its[0], speed[1] - its[1])
        even = (relative[0] ** 2 + relative[1] ** 2) / (2.0 * math.dist(state.position_table_m, there))
        limits = replace(
            self._limits,
            speed=self._config.fastest_m_s,
            acceleration=along.accelerating(BRAKE_SHARE),
            braking=min(max(even, along.braking(LEAST_SHARE)), along.braking(1.0)),
        )
        way = PointReference(limits, state.position_table_m, speed)
        self._is_fast = not is_near
        if is_near:
            way.advance(there, its, dt_s)
        else:
            to_go = (there[0] - here[0], there[1] - here[1])
            way.acceleration = fastest_acceleration(to_go, relative, along, self._config.fastest_m_s)
        return way

    def _coasting(
        self, way: PointReference | CoastingWay, state: ControlState, goal: Goal, there: Vector2
    ) -> PointReference | CoastingWay:
        """A way of least gas where one can begin, the same while it lasts, then one that follows the goal."""
        nearest_m = max(LEAST_WAY_M, self._config.capture_m)
        if isinstance(way, CoastingWay):
            if not way.is_at_goal and math.dist(way.goal, there) <= nearest_m:
                return way
            return PointReference(self._limits, way.position, way.velocity)
        distance_m = math.dist(way.position, there)
        is_at_rest = math.hypot(*way.velocity) <= AT_REST_M_S and goal.velocity_table_m_s == (0.0, 0.0)
        if distance_m <= nearest_m or not is_at_rest:
            return way
        along = self._authority(way.position, there, state, goal)
        push = GAS_SHARE * min(along.forwards_m_s2, along.backwards_m_s2)
        if abs(along.pull_m_s2) >= 0.5 * push:
            return way
        speed = self._config.speed_m_s
        duration_s = self._config.duration_s or distance_m / speed + speed / push
        return CoastingWay(way.position, there, least_gas(distance_m, duration_s, push, along.pull_m_s2))

    def _authority(self, start: Vector2, end: Vector2, state: ControlState, goal: Goal) -> Authority:
        """What the valves give along a way, as the mock-up points now."""
        length_m = math.dist(start, end)
        direction = ((end[0] - start[0]) / length_m, (end[1] - start[1]) / length_m)
        turns = abs(wrap_angle(goal.heading_rad - state.heading_rad)) > TURNS_RAD
        slope, found = state.slope_table_m_s2, self._station.disturbance_table_m_s2
        pull = (slope[0] + found[0], slope[1] + found[1])
        heading_rad = None if turns else state.heading_rad
        return authority_along(direction, heading_rad, pull, self._vehicle, self._envelope)
