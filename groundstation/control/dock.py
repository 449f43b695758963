"""Docking: along the corridor of another mock-up's port to a soft first contact.

Go round to the gate before the port, wait there until it is calm, come in along the axis as it turns, slower
and slower, until it bounces off (W. Fehse, Automated Rendezvous and Docking of Spacecraft, 2003,
chapters 4 and 5: hold point, straight-line approach in a corridor, abort to the hold point). Who leaves the
corridor, comes in too fast or loses sight of the target backs out along the axis and tries again.
"""

import enum
import math
from collections.abc import Mapping
from dataclasses import replace

from pydantic import ConfigDict, Field

from groundstation.control.controller import NO_NEIGHBOURS, span_of
from groundstation.control.corridor import Corridor
from groundstation.control.go_to import GoTo, GoToConfig
from groundstation.control.keep_in import KeepIn
from groundstation.control.state import BodyWrench, ControlState, Goal, Vector2, rotate
from groundstation.control.vehicle import NEAREST_M, VehicleModel
from groundstation.files.plain_model import PlainModel
from groundstation.frames import wrap_angle

_STEP_RAD = math.radians(25.0)  # ahead of it on the way round to the gate
_IN_LINE_RAD = math.radians(15.0)
_CALM_M, _CALM_M_S, _CALM_RAD, _CALM_S = 0.012, 0.008, math.radians(2.0), 3.0
_SMOOTHING_S = 1.0  # of the target's velocity and rate: it is no manoeuvring target
_BERTH_M = 0.03  # from contact, where it stays afterwards
_TOUCHED_M = 0.004  # who parts from nearer than this has touched: estimates are off by a millimetre or two
_BACK_M_S2 = 0.004
_LAG_M = 0.02  # so far behind its reference it waits


class Phase(enum.StrEnum):
    """What it is at."""

    GATE = "goes to the gate"
    IN = "comes in"
    BACK = "backs out"
    DOCKED = "has touched"


class DockConfig(PlainModel):
    """Whom to dock with, and how.

    Attributes:
        target: Name of the other mock-up.
        axis_deg: Of its port, counter-clockwise from its +x.
        own_axis_deg: Of the own port, likewise.
        half_angle_deg: Of the corridor.
        length_m: Of the corridor, from contact outwards.
        contact_m: Between the centres at contact.
        lateral_m: Half the corridor's width at contact.
        approach_m_s: Largest closing speed.
        contact_m_s: Closing speed at contact.
        slowing_m_s2: Deceleration between both.
        press_m: So far beyond contact it presses on where no bounce was seen.
        go_to: How to get to the gate.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    target: str
    axis_deg: float = Field(default=0.0, ge=-360.0, le=360.0)
    own_axis_deg: float = Field(default=0.0, ge=-360.0, le=360.0)
    half_angle_deg: float = Field(default=15.0, gt=0.0, le=45.0)
    length_m: float = Field(default=0.40, ge=0.1, le=5.0)
    contact_m: float = Field(default=0.40, gt=0.0, le=5.0)
    lateral_m: float = Field(default=0.015, gt=0.0, le=0.2)
    approach_m_s: float = Field(default=0.03, gt=0.0, le=0.2)
    contact_m_s: float = Field(default=0.006, gt=0.0, le=0.05)
    slowing_m_s2: float = Field(default=0.002, gt=0.0, le=0.1)
    press_m: float = Field(default=0.008, ge=0.0, le=0.05)
    go_to: GoToConfig = GoToConfig(speed_m_s=0.08)

    def corridor(self) -> Corridor:
        """In radians."""
        return Corridor(
            math.radians(self.axis_deg),
            math.radians(self.half_angle_deg),
            self.length_m,
            self.contact_m,
            self.lateral_m,
            self.approach_m_s,
            self.contact_m_s,
            self.slowing_m_s2,
        )


class Dock:
    """Controller row ``dock``.

    Raises:
        ValueError: The gate is too near to the target, or contact faster than the approach.
    """

    def __init__(self, config: DockConfig, vehicle: VehicleModel, keep_in: KeepIn | None = None) -> None:
        self._gate_m = config.corridor().gate_m
        if self._gate_m < NEAREST_M:
            raise ValueError(
                f"length_m: the gate would be {self._gate_m:.2f} m from it, give {NEAREST_M:g} m"
            )
        if config.contact_m_s > config.approach_m_s:
            raise ValueError(
                f"contact_m_s: {config.contact_m_s:g} is more than approach_m_s = {config.approach_m_s:g}"
            )
        self._config, self._corridor = config, config.corridor()
        self._own_axis_rad = math.radians(config.own_axis_deg)
        self._go_to = GoTo(config.go_to, vehicle, keep_in)
        self.reset()

    def reset(self) -> None:
        """Forget how far it was: the next update goes to the gate."""
        self._go_to.reset()
        self._phase = Phase.GATE
        self._along_m = self._gate_m
        self._speed_m_s = 0.0
        self._calm_s = 0.0
        self._target: ControlState | None = None
        self._held: Goal | None = None

    @property
    def phase(self) -> Phase:
        """What it is at."""
        return self._phase

    def setpoint(self, goal: Goal) -> Goal:
        """Where it is to be at present; the goal before the first update."""
        return self._held or goal

    def update(
        self,
        state: ControlState,
        goal: Goal,
        dt_s: float,
        *,
        applied: BodyWrench | None = None,
        neighbours: Mapping[str, ControlState] = NO_NEIGHBOURS,
    ) -> BodyWrench:
        """See `Controller.update`; the goal is not looked at."""
        del goal
        state, span_s = state.bounded(), span_of(dt_s)
        seen = neighbours.get(self._config.target)
        if seen is None:
            self._held = self._unseen(state)
        else:
            target = self._smoothed(seen.bounded(), span_s)
            self._change_phase(state, target, span_s)
            self._move(state, target, span_s)
            self._held = self._wanted(state, target)
        return self._go_to.update(state, self._held, dt_s, applied=applied)

    def _unseen(self, state: ControlState) -> Goal:
        """Nobody to dock with: stay where it is; who was coming in backs out once it sees again."""
        if self._phase is Phase.IN:
            self._phase, self._speed_m_s = Phase.BACK, 0.0
        if self._target is not None or self._held is None:
            self._target = None
            return Goal(state.position_table_m, state.heading_rad)
        return replace(self._held, velocity_table_m_s=(0.0, 0.0), rate_rad_s=0.0)

    def _smoothed(self, target: ControlState, span_s: float) -> ControlState:
        """The target, its velocity and rate averaged: it holds or turns, it does not manoeuvre."""
        before = self._target
        if before is not None:
            share = 1.0 - math.exp(-span_s / _SMOOTHING_S)
            (vx, vy), (ux, uy) = before.velocity_table_m_s, target.velocity_table_m_s
            target = replace(
                target,
                velocity_table_m_s=(vx + share * (ux - vx), vy + share * (uy - vy)),
                rate_rad_s=before.rate_rad_s + share * (target.rate_rad_s - before.rate_rad_s),
            )
        self._target = target
        return target

    def _change_phase(self, state: ControlState, target: ControlState, span_s: float) -> None:
        corridor, config = self._corridor, self._config
        at = corridor.relative(state, target)
        if self._phase is Phase.GATE:
            off_m = math.hypot(at.along_m - self._gate_m, at.aside_m)
            is_calm = (
                off_m < _CALM_M
                and math.hypot(at.closing_m_s, at.sliding_m_s) < _CALM_M_S
                and abs(wrap_angle(self._heading_rad(target) - state.heading_rad)) < _CALM_RAD
            )
            self._calm_s = self._calm_s + span_s if is_calm else 0.0
            if self._calm_s >= _CALM_S:
                self._phase, self._along_m, self._speed_m_s = Phase.IN, at.along_m, 0.0
        elif self._phase is Phase.IN:
            has_bounced = at.closing_m_s < 0.0 and at.along_m < config.contact_m + _TOUCHED_M
            if has_bounced or self._along_m <= config.contact_m - config.press_m:
                self._phase = Phase.DOCKED  # to press on would slide one hull along the other
            elif corridor.objection(state, target):
                self._phase, self._speed_m_s = Phase.BACK, 0.0
                self._along_m = max(at.along_m, config.contact_m)
        elif self._phase is Phase.BACK and self._along_m >= self._gate_m:
            self._phase, self._calm_s = Phase.GATE, 0.0

    def _move(self, state: ControlState, target: ControlState, span_s: float) -> None:
        """Carry the place on the axis on: inwards by the speed that is meant there, outwards to the gate."""
        step, config = _BACK_M_S2 * span_s, self._config
        if self._phase is Phase.IN:
            wanted = self._corridor.speed_m_s(self._along_m - config.contact_m)
            behind_m = self._corridor.relative(state, target).along_m - self._along_m
            if behind_m > _LAG_M + config.press_m:
                wanted = 0.0
            self._speed_m_s = min(wanted, self._speed_m_s + step)
            self._along_m -= self._speed_m_s * span_s
        elif self._phase in (Phase.BACK, Phase.DOCKED):
            end_m = self._gate_m if self._phase is Phase.BACK else config.contact_m + _BERTH_M
            self._speed_m_s = max(-config.approach_m_s, self._speed_m_s - step)
            self._along_m = min(self._along_m - min(self._speed_m_s, 0.0) * span_s, end_m)
            if self._along_m >= end_m:
                self._speed_m_s = 0.0
        else:
            self._along_m, self._speed_m_s = self._gate_m, 0.0

    def _heading_rad(self, target: ControlState) -> float:
        """Port faces port."""
        return target.heading_rad + self._corridor.axis_rad + math.pi - self._own_axis_rad

    def _wanted(self, state: ControlState, target: ControlState) -> Goal:
        corridor, rate = self._corridor, target.rate_rad_s
        place, velocity = corridor.place(target, self._along_m)
        axis_rad = target.heading_rad + corridor.axis_rad
        inward = rotate((-self._speed_m_s, 0.0), axis_rad)
        if self._phase is Phase.GATE:
            way = self._round(state, target, axis_rad)
            if way is not None:
                return Goal(way, self._heading_rad(target), (0.0, 0.0), rate)
        arm = (place[0] - target.position_table_m[0], place[1] - target.position_table_m[1])
        # what turns with the target is held on its circle, and coming in on a turning line is bent aside
        bent = (
            -(rate**2) * arm[0] - 2.0 * rate * inward[1],
            -(rate**2) * arm[1] + 2.0 * rate * inward[0],
        )
        moving = (velocity[0] + inward[0], velocity[1] + inward[1])
        return Goal(place, self._heading_rad(target), moving, rate, bent)

    def _round(self, state: ControlState, target: ControlState, axis_rad: float) -> Vector2 | None:
        """The next place on the way round the target; None once it is before the port."""
        x, y = target.position_table_m
        bearing_rad = math.atan2(state.position_table_m[1] - y, state.position_table_m[0] - x)
        left_rad = wrap_angle(axis_rad - bearing_rad)
        if abs(left_rad) <= _IN_LINE_RAD:
            return None
        bearing_rad += math.copysign(min(_STEP_RAD, abs(left_rad)), left_rad)
        return x + self._gate_m * math.cos(bearing_rad), y + self._gate_m * math.sin(bearing_rad)
