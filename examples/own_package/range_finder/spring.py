"""Controller ``spring``: the goal pulls like a spring with a damper.

It learns nothing: on a table that is off level by an acceleration a it stands a / frequency² beside its goal.
"""

import math
from collections.abc import Mapping

from pydantic import BaseModel, ConfigDict, Field

from groundstation.control.controller import NO_NEIGHBOURS
from groundstation.control.controllers import ControllerRow
from groundstation.control.keep_in import KeepIn
from groundstation.control.state import BodyWrench, ControlState, Goal, clamp, limit_length, rotate
from groundstation.control.vehicle import VehicleModel
from groundstation.control.wrench_envelope import WrenchEnvelope
from groundstation.frames import wrap_angle

LARGEST_ERROR_M, LARGEST_ERROR_RAD = 0.1, 0.2
"""Errors beyond count as this much, which bounds the speed of the way back."""


class SpringConfig(BaseModel):
    """Parameters of a rig's ``control`` section; a key that is not here is refused when the rig is read."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    frequency_rad_s: float = Field(default=0.8, gt=0.0, le=3.0)
    damping_ratio: float = Field(default=1.0, ge=0.5, le=3.0)


class Spring:
    """A force towards the goal and against the velocity, the same for the heading."""

    def __init__(self, config: SpringConfig, vehicle: VehicleModel, keep_in: KeepIn | None = None) -> None:
        del keep_in  # goals outside are refused before they come here
        self._stiffness = config.frequency_rad_s**2
        self._damping = 2.0 * config.damping_ratio * config.frequency_rad_s
        self._vehicle, self._envelope = vehicle, WrenchEnvelope(vehicle)

    def reset(self) -> None:
        """There is no past to forget."""

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
        """See ``groundstation.control.controller.Controller.update``."""
        del applied, neighbours
        if not (math.isfinite(dt_s) and dt_s > 0.0):
            raise ValueError(f"dt_s must be above 0, found {dt_s}")
        state, goal = state.bounded(), goal.bounded()
        (x, y), (x_goal, y_goal) = state.position_table_m, goal.position_table_m
        (vx, vy), (vx_goal, vy_goal) = state.velocity_table_m_s, goal.velocity_table_m_s
        way_x, way_y = limit_length((x_goal - x, y_goal - y), LARGEST_ERROR_M)
        turn = clamp(wrap_angle(goal.heading_rad - state.heading_rad), LARGEST_ERROR_RAD)
        force_table_n = (
            self._vehicle.mass_kg * (self._stiffness * way_x + self._damping * (vx_goal - vx)),
            self._vehicle.mass_kg * (self._stiffness * way_y + self._damping * (vy_goal - vy)),
        )
        turning_rad_s2 = self._stiffness * turn + self._damping * (goal.rate_rad_s - state.rate_rad_s)
        torque_nm = self._vehicle.inertia_kg_m2 * turning_rad_s2
        return self._envelope.saturate(BodyWrench(rotate(force_table_n, -state.heading_rad), torque_nm))


SPRING = ControllerRow("pull to the goal pose like a damped spring", SpringConfig, Spring)
