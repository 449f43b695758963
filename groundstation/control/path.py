"""Path following: waypoint after waypoint on straight ways, or round after round on a closed curve.

Velocity and acceleration are fed forward. Between waypoints the reference stops at each: on a table without
friction a corner that is cut or overshot costs more gas than one that is stopped at. It starts from where the
mock-up is, so that the first way leads to the first waypoint, or to the nearest point of the curve, and
starts again from there if the mock-up falls far behind.
"""

import itertools
import math
from collections.abc import Mapping
from typing import Literal

from pydantic import ConfigDict, Field, field_validator, model_validator

from groundstation.control.controller import NO_NEIGHBOURS, span_of
from groundstation.control.curves import Curve, FigureEight, Perimeter, sampled, tightest_per_m
from groundstation.control.keep_in import KeepIn
from groundstation.control.laps import Laps
from groundstation.control.reference import MotionLimits, PointReference
from groundstation.control.state import BodyWrench, ControlState, Goal, Vector2
from groundstation.control.station import StationConfig, StationKeeping
from groundstation.control.vehicle import VehicleModel
from groundstation.files.plain_model import PlainModel
from groundstation.frames import wrap_angle


class PathConfig(PlainModel):
    """A way over the table.

    Attributes:
        shape: ``waypoints``; ``perimeter``, a rectangle with rounded corners, or ``figure_eight``: these are
            driven round and round without a stop.
        centre_m: Of a curve, table x, y.
        size_m: Of a curve along table x and y.
        corner_radius_m: Of the perimeter.
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

    shape: Literal["waypoints", "perimeter", "figure_eight"] = "waypoints"
    centre_m: Vector2 = (0.0, 0.0)
    size_m: Vector2 | None = None
    corner_radius_m: float = Field(default=0.3, gt=0.0, le=10.0)
    waypoints_m: tuple[Vector2, ...] = ()
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

    @model_validator(mode="after")
    def _has_its_shape(self) -> "PathConfig":
        if self.shape == "waypoints":
            if not self.waypoints_m:
                raise ValueError("waypoints_m: shape = 'waypoints' needs at least one")
            if self.size_m is not None:
                raise ValueError("size_m goes with shape = 'perimeter' or 'figure_eight'")
            return self
        if self.waypoints_m:
            raise ValueError(f"waypoints_m go with shape = 'waypoints', found {self.shape!r}")
        if self.size_m is None or not all(0.0 < size <= 100.0 for size in self.size_m):
            raise ValueError(f"size_m: shape = {self.shape!r} needs two lengths within 0 and 100 m")
        if self.shape == "perimeter" and 2.0 * self.corner_radius_m > min(self.size_m):
            raise ValueError("corner_radius_m may be half the shorter side of size_m at most")
        return self

    def curve(self) -> Curve | None:
        """The closed curve; None where waypoints are flown."""
        if self.size_m is None:
            return None
        if self.shape == "perimeter":
            return Perimeter(self.centre_m, self.size_m, self.corner_radius_m)
        return FigureEight(self.centre_m, self.size_m)


class PathFollowing:
    """Controller row ``path``.

    Raises:
        ValueError: A waypoint or a curve lies outside the part of the table that vehicles keep to, or a bend
            is too tight for the speed.
    """

    def __init__(self, config: PathConfig, vehicle: VehicleModel, keep_in: KeepIn | None = None) -> None:
        for number, (x, y) in enumerate(config.waypoints_m):
            if keep_in is not None and min(keep_in.edge_distances_m((x, y))) < 0.0:
                raise ValueError(
                    f"waypoints_m.{number}: ({x:g}, {y:g}) m lies outside the part of the table that "
                    "vehicles keep to"
                )
        self._config, self._curve = config, config.curve()
        if self._curve is not None:
            _check_curve(self._curve, config, keep_in)
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
        self._laps: Laps | None = None

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
        step = self._advanced if self._curve is None else self._round
        reference = step(state.bounded(), span_of(dt_s))
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

    def _round(self, state: ControlState, dt_s: float) -> Goal:
        """One step on a closed curve."""
        laps, turn, here = self._laps, self._turn, state.position_table_m
        assert self._curve is not None
        if laps is None or math.dist(laps.position, here) > self._config.restart_error_m:
            laps = Laps(self._curve, self._limits, here, state.velocity_table_m_s)
        if turn is None:
            turn = PointReference(self._turn_limits, (state.heading_rad, 0.0), (state.rate_rad_s, 0.0))
            self._heading_rad = state.heading_rad
        laps.advance(dt_s)
        is_along = self._config.heading == "along"
        wanted_rad, rate = (
            (laps.point.direction_rad, laps.rate_rad_s) if is_along else (self._heading_rad, 0.0)
        )
        turn.advance((turn.position[0] + wrap_angle(wanted_rad - turn.position[0]), 0.0), (rate, 0.0), dt_s)
        self._laps, self._turn = laps, turn
        heading = (wrap_angle(turn.position[0]), turn.velocity[0], turn.acceleration[0])
        return Goal(laps.position, heading[0], laps.velocity, heading[1], laps.acceleration, heading[2])

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


def _check_curve(curve: Curve, config: PathConfig, keep_in: KeepIn | None) -> None:
    """Refuse what cannot be driven."""
    for point in sampled(curve):
        x, y = point.position_table_m
        if keep_in is not None and min(keep_in.edge_distances_m((x, y))) < 0.0:
            raise ValueError(
                f"size_m: the {config.shape} passes ({x:.2f}, {y:.2f}) m, outside the part of the table that "
                "vehicles keep to"
            )
    needed_m_s2 = config.speed_m_s**2 * tightest_per_m(curve)
    if needed_m_s2 > config.acceleration_m_s2:
        raise ValueError(
            f"speed_m_s: {config.speed_m_s:g} m/s needs {needed_m_s2:.3f} m/s^2 in the tightest bend of the "
            f"{config.shape}, more than acceleration_m_s2 = {config.acceleration_m_s2:g}"
        )
