"""Turning on the spot: a place is held while the heading turns at a constant rate; others dock with it."""

import math
from collections.abc import Mapping

from pydantic import BaseModel, ConfigDict, Field

from groundstation.control.controller import NO_NEIGHBOURS
from groundstation.control.keep_in import KeepIn
from groundstation.control.state import BodyWrench, ControlState, Goal, clamp
from groundstation.control.station import LONGEST_SPAN_S, StationConfig, StationKeeping
from groundstation.control.vehicle import VehicleModel
from groundstation.frames import wrap_angle

_FARTHEST_AHEAD_RAD = math.radians(5.0)


class TurnConfig(BaseModel):
    """How it turns.

    Attributes:
        rate_deg_s: Counter-clockwise positive.
        angular_acceleration_deg_s2: On the way to it.
        station: Of the law that holds the place.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    rate_deg_s: float = Field(default=3.0, ge=-30.0, le=30.0)
    angular_acceleration_deg_s2: float = Field(default=0.5, gt=0.0, le=30.0)
    station: StationConfig = StationConfig()


class Turn:
    """Controller row ``turn``."""

    def __init__(self, config: TurnConfig, vehicle: VehicleModel, keep_in: KeepIn | None = None) -> None:
        del keep_in
        self._station = StationKeeping(config.station, vehicle)
        self._rate_rad_s = math.radians(config.rate_deg_s)
        self._acceleration_rad_s2 = math.radians(config.angular_acceleration_deg_s2)
        self.reset()

    def reset(self) -> None:
        """Forget how far it has turned: the next update begins from its heading, at rest."""
        self._station.reset()
        self._heading_rad: float | None = None
        self._rate_now_rad_s = 0.0
        self._reference: Goal | None = None

    def setpoint(self, goal: Goal) -> Goal:
        """The place of the goal, with the heading of now."""
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
        """See `Controller.update`; of the goal, the place is kept."""
        if not (math.isfinite(dt_s) and dt_s > 0.0):
            raise ValueError(f"dt_s must be above 0, found {dt_s}")
        state, goal, span_s = state.bounded(), goal.bounded(), min(dt_s, LONGEST_SPAN_S)
        if self._heading_rad is None:
            self._heading_rad = state.heading_rad
        change = clamp(self._rate_rad_s - self._rate_now_rad_s, self._acceleration_rad_s2 * span_s)
        # it does not run away from a mock-up that cannot follow
        ahead_rad = clamp(wrap_angle(self._heading_rad - state.heading_rad), _FARTHEST_AHEAD_RAD)
        self._heading_rad = state.heading_rad + ahead_rad + (self._rate_now_rad_s + 0.5 * change) * span_s
        self._rate_now_rad_s += change
        self._reference = Goal(
            goal.position_table_m,
            wrap_angle(self._heading_rad),
            rate_rad_s=self._rate_now_rad_s,
            angular_acceleration_rad_s2=change / span_s,
        )
        return self._station.update(state, self._reference, dt_s, applied=applied)
