"""Path following: waypoint after waypoint on straight ways, with velocity and acceleration fed forward.

The reference stops at each waypoint: on a table without friction a corner that is cut or overshot costs more
gas than one that is stopped at. It starts from where the mock-up is, so that the first way leads to the
first waypoint, and starts again from there if the mock-up falls far behind.
"""

import itertools
import math
from collections.abc import Mapping
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator

from groundstation.control.controller import NO_NEIGHBOURS
from groundstation.control.keep_in import KeepIn
from groundstation.control.reference import MotionLimits, PointReference
from groundstation.control.state import BodyWrench, ControlState, Goal, Vector2
from groundstation.control.station import LONGEST_SPAN_S, StationConfig, StationKeeping
from groundstation.control.vehicle import VehicleModel
from groundstation.frames import wrap_angle


class PathConfig(BaseModel):
    """A way over the table.

    Attributes:
        waypoints_m: x, y in the table frame, in order.
        closed: After the last waypoint comes the first again, without end.
        speed_m_s: Largest speed of the reference.
        acceleration_m_s2: Largest acceleration.
        heading: ``held`` keeps the heading of the start; ``along`` points body +x along the way.
        rate_deg_s: Largest rate of turning.
        angular_acceleration_deg_s2: Largest angular acceleration.
        restart_error_m: Distance between mock-up and reference that starts the reference anew.
        station: Of the law that follows the reference.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    waypoints_m: tuple[Vector2, ...] = Field(min_length=1)
    closed: bool = False
    speed_m_s: float = Field(default=0.06, gt=0.0, le=1.0)
    acceleration_m_s2: float = Field(default=0.015, gt=0.0, le=1.0)
    heading: Literal["held", "along"] = "held"
    rate_deg_s: float = Field(default=10.0, gt=0.0, le=360.0)
    angular_acceleration_deg_s2: float = Field(default=5.0, gt=0.0, le=360.0)
    restart_error_m: float = Field(default=0.15, gt=0.0)
    station: StationConfig = StationConfig()

    @field_validator("waypoints_m")
    @classmethod
    def _apart(cls, waypoints_m: tuple[Vector2, ...]) -> tuple[Vector2, ...]:
        for number, (here, there) in enumerate(itertools.pairwise(waypoints_m)):
            if not math.dist(here, there) > 0.0:  # NaN, too
                raise ValueError(f"waypoints {number} and {number + 1} are the same place {there}")
        return waypoints_m


class PathFollowing:
    """Controller row ``path``.

    Raises:
        ValueError: A waypoint lies outside the part of the table that vehicles keep to.
    """

    def __init__(self, config: PathConfig, vehicle: VehicleModel, keep_in: KeepIn | None = None) -> None:
        for number, (x, y) in enumerate(config.waypoints_m):
            if keep_in is not None and min(keep_in.edge_distances_m((x, y))) < 0.0:
                raise ValueError(
                    f"waypoints_m.{number}: ({x:g}, {y:g}) m lies outside the part of the table that "
                    "vehicles keep to"
                )
        self._config = config
        self._station = StationKeeping(config.station, vehicle)
        self._limits = MotionLimits(config.speed_m_s, config.acceleration_m_s2)
        self._turn_limits = MotionLimits(
            math.radians(config.rate_deg_s), math.radians(config.angular_acceleration_deg_s2)
        )
        self.reset()

    def reset(self) -> None:
        """Forget the way: the next update starts to the first waypoint."""
        self._station.reset()
        self._next = 0
        self._heading_rad = 0.0
        self._way: PointReference | None = None
        self._turn: PointReference | None = None
        self._reference: Goal | None = None

    def setpoint(self, goal: Goal) -> Goal:
        """Where the reference is; the goal before the first update."""
        return self._reference or goal

    def update(
        self,
        state: ControlState,
        goal: Goal,
        dt_s: float,
        *,
        applied: BodyWrench | None = None,
        neighbours: Mapping[str, ControlState] = NO_NEIGHBOURS,
    ) -> BodyWrench:
        """See `Controller.update`; goal and neighbours are not looked at."""
        if not (math.isfinite(dt_s) and dt_s > 0.0):
            raise ValueError(f"dt_s must be above 0, found {dt_s}")
        reference = self._advanced(state.bounded(), min(dt_s, LONGEST_SPAN_S))
        self._reference = reference
        return self._station.update(state, reference, dt_s, applied=applied)

    def _advanced(self, state: ControlState, dt_s: float) -> Goal:
        way, turn = self._way, self._turn
        here = state.position_table_m
        if way is None or math.dist(way.position, here) > self._config.restart_error_m:
            way = PointReference(self._limits, here, state.velocity_table_m_s)
            self._begin_leg(here)
        if turn is None:
            turn = PointReference(self._turn_limits, (state.heading_rad, 0.0), (state.rate_rad_s, 0.0))
            if self._config.heading == "held":
                self._heading_rad = state.heading_rad
        if way.is_at_goal and self._take_next():
            self._begin_leg(way.position)
        aim_rad = turn.position[0] + wrap_angle(self._heading_rad - turn.position[0])
        way.advance(self._config.waypoints_m[self._next], (0.0, 0.0), dt_s)
        turn.advance((aim_rad, 0.0), (0.0, 0.0), dt_s)
        self._way, self._turn = way, turn
        return Goal(
            way.position,
            wrap_angle(turn.position[0]),
            way.velocity,
            turn.velocity[0],
            way.acceleration,
            turn.acceleration[0],
        )

    def _begin_leg(self, here: Vector2) -> None:
        there = self._config.waypoints_m[self._next]
        if self._config.heading == "along" and here != there:
            self._heading_rad = math.atan2(there[1] - here[1], there[0] - here[0])

    def _take_next(self) -> bool:
        """Whether there is another waypoint to go to."""
        last = len(self._config.waypoints_m) - 1
        if self._next == last and not (self._config.closed and last):
            return False
        self._next = 0 if self._next == last else self._next + 1
        return True
