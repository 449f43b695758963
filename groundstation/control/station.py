"""Station keeping: hold or follow a moving pose with on-off valves on a table that is never quite level.

LQR feedback on position and heading, with velocity from `DisturbanceObserver`, whose disturbance estimate is
fed forward. Feedback that is smaller than what the estimate's own noise causes would only burn gas, so it is
shrunk by a dead band (soft, so that the law has no step); the disturbance is paid for in full.
"""

import math
from collections.abc import Mapping

from pydantic import ConfigDict, Field

from groundstation.control.controller import NO_NEIGHBOURS, span_of
from groundstation.control.gains import lqr_gains
from groundstation.control.observer import DisturbanceObserver
from groundstation.control.state import (
    NO_WRENCH,
    BodyWrench,
    ControlState,
    Goal,
    Vector2,
    clamp,
    limit_length,
    rotate,
)
from groundstation.control.vehicle import VehicleModel
from groundstation.control.wrench_envelope import WrenchEnvelope
from groundstation.files.plain_model import PlainModel
from groundstation.frames import wrap_angle

LEARNING_SHARE = 0.5
"""Of the force in every direction: who pushes harder learns nothing of the table, for a twentieth of that
push, by which valves differ, would pass for a slope."""


class StationConfig(PlainModel):
    """Weights and limits of station keeping.

    Attributes:
        position_error_m: Error that is worth `acceleration_m_s2` (LQR weights), likewise for heading.
        largest_error_m: Errors beyond count as this much, which bounds the speed of the way back.
        position_deadband_m: Error that asks for no feedback.
        observer_rad_s: Poles of the velocity and disturbance observers.
        largest_slope_m_s2: Largest disturbance believed.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    position_error_m: float = Field(default=0.015, gt=0.0)
    acceleration_m_s2: float = Field(default=0.010, gt=0.0)
    largest_error_m: float = Field(default=0.10, gt=0.0)
    position_deadband_m: float = Field(default=0.0005, ge=0.0)
    observer_rad_s: float = Field(default=0.6, gt=0.0)
    largest_slope_m_s2: float = Field(default=0.010, ge=0.0)
    heading_error_deg: float = Field(default=0.3, gt=0.0)
    angular_acceleration_deg_s2: float = Field(default=0.5, gt=0.0)
    largest_heading_error_deg: float = Field(default=10.0, gt=0.0)
    heading_deadband_deg: float = Field(default=0.02, ge=0.0)
    heading_observer_rad_s: float = Field(default=0.8, gt=0.0)
    largest_disturbance_torque_nm: float = Field(default=0.010, ge=0.0)


class StationKeeping:
    """Controller row ``station``; also the inner law of the others."""

    def __init__(self, config: StationConfig, vehicle: VehicleModel) -> None:
        self._config = config
        self._vehicle = vehicle
        self._envelope = WrenchEnvelope(vehicle)
        self._gains = lqr_gains(config.position_error_m, config.acceleration_m_s2)
        self._heading_gains = lqr_gains(
            math.radians(config.heading_error_deg), math.radians(config.angular_acceleration_deg_s2)
        )
        self._heading_limit_rad = math.radians(config.largest_heading_error_deg)
        self._deadband_m_s2 = config.position_deadband_m * self._gains.stiffness_per_s2
        self._heading_deadband_rad_s2 = (
            math.radians(config.heading_deadband_deg) * self._heading_gains.stiffness_per_s2
        )
        self.reset()

    def reset(self) -> None:
        """Forget disturbances and velocities."""
        config = self._config
        slope, turn = config.largest_slope_m_s2, config.largest_disturbance_torque_nm
        self._x = DisturbanceObserver(config.observer_rad_s, slope)
        self._y = DisturbanceObserver(config.observer_rad_s, slope)
        self._turn = DisturbanceObserver(config.heading_observer_rad_s, turn / self._vehicle.inertia_kg_m2)
        self._last = NO_WRENCH

    @property
    def disturbance_table_m_s2(self) -> Vector2:
        """Acceleration found beyond valves and known slope, (x, y)."""
        return self._x.disturbance, self._y.disturbance

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
        state, goal = state.bounded(), goal.bounded()
        self._observe(state, self._last if applied is None else applied, span_of(dt_s))
        force = rotate(self._force_table_n(state, goal), -state.heading_rad)
        self._last = self._envelope.saturate(BodyWrench(force, self._torque_nm(state, goal)))
        return self._last

    def _observe(self, state: ControlState, applied: BodyWrench, dt_s: float) -> None:
        mass_kg = self._vehicle.mass_kg
        acted = self._envelope.saturate(applied)
        push, slope = rotate(acted.force_body_n, state.heading_rad), state.slope_table_m_s2
        learns = math.hypot(*push) <= LEARNING_SHARE * self._envelope.max_force_n
        self._x.update(state.velocity_table_m_s[0], push[0] / mass_kg + slope[0], dt_s, learns=learns)
        self._y.update(state.velocity_table_m_s[1], push[1] / mass_kg + slope[1], dt_s, learns=learns)
        self._turn.update(state.rate_rad_s, acted.torque_nm / self._vehicle.inertia_kg_m2, dt_s)

    def _force_table_n(self, state: ControlState, goal: Goal) -> Vector2:
        here, there = state.position_table_m, goal.position_table_m
        wanted, forward, slope = goal.velocity_table_m_s, goal.acceleration_table_m_s2, state.slope_table_m_s2
        error = limit_length((there[0] - here[0], there[1] - here[1]), self._config.largest_error_m)
        stiffness, damping = self._gains.stiffness_per_s2, self._gains.damping_per_s
        feedback = _shrink(
            (
                stiffness * error[0] + damping * (wanted[0] - self._x.speed),
                stiffness * error[1] + damping * (wanted[1] - self._y.speed),
            ),
            self._deadband_m_s2,
        )
        mass_kg = self._vehicle.mass_kg
        return (
            mass_kg * (feedback[0] + forward[0] - slope[0] - self._x.disturbance),
            mass_kg * (feedback[1] + forward[1] - slope[1] - self._y.disturbance),
        )

    def _torque_nm(self, state: ControlState, goal: Goal) -> float:
        error = clamp(wrap_angle(goal.heading_rad - state.heading_rad), self._heading_limit_rad)
        feedback = self._heading_gains.stiffness_per_s2 * error
        feedback += self._heading_gains.damping_per_s * (goal.rate_rad_s - self._turn.speed)
        feedback = math.copysign(max(0.0, abs(feedback) - self._heading_deadband_rad_s2), feedback)
        wanted = feedback + goal.angular_acceleration_rad_s2 - self._turn.disturbance
        return self._vehicle.inertia_kg_m2 * wanted


def _shrink(vector: Vector2, deadband: float) -> Vector2:
    """The vector, shorter by the dead band; zero inside it."""
    length = math.hypot(*vector)
    if length <= deadband:
        return 0.0, 0.0
    scale = 1.0 - deadband / length
    return vector[0] * scale, vector[1] * scale
