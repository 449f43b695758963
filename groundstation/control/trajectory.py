"""Reconfiguration: each ship flies its own part of one plan that all of them make by themselves.

The plan follows from what is stated alone (starts, places, margins), so that every ship has the same one
without a word between them. It is flown with velocity and acceleration fed forward, at a pace that all keep
together: who sees another ship, or itself, lag behind the plan slows down until it has caught up, and stops
while one is not seen at all (a path's own clock that waits for its follower: A. P. Aguiar, J. P. Hespanha,
Trajectory-Tracking and Path-Following of Underactuated Autonomous Vehicles with Parametric Modeling
Uncertainty, IEEE Trans. Automatic Control 52(8), 2007; between ships: R. Ghabcheloo and others, Coordinated
path-following in the presence of communication losses and time delays, SIAM J. Control Optim. 48(1), 2009).
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from pydantic import ConfigDict, Field

from groundstation.control.controller import NO_NEIGHBOURS, span_of
from groundstation.control.edge import braking_to_count_on
from groundstation.control.go_to import GoTo, GoToConfig
from groundstation.control.keep_in import KeepIn
from groundstation.control.safety_filter import SafetyFilterConfig
from groundstation.control.state import BodyWrench, ControlState, Goal, Vector2, clamp
from groundstation.control.station import StationConfig, StationKeeping
from groundstation.control.vehicle import VehicleModel
from groundstation.control.wrench_envelope import WrenchEnvelope
from groundstation.files.plain_model import PlainModel

if TYPE_CHECKING:
    from groundstation.control.trajectories import Plan, Reconfiguration

_MOST_OF_THE_VALVES = 0.6  # that a plan may ask for: the rest fights slope, noise and turning
_BEGIN_M, _BEGIN_M_S = 0.04, 0.015  # nearer to its start and slower than this, a ship may begin
_CAPTURE_M = 0.25  # from farther away than this nobody flies to a start: there is no plan for that way
_OTHERS_M = 0.12  # so near to its way another ship is when one begins
_LAG_FREE_M, _LAG_STOP_M = 0.03, 0.09  # behind the plan: full pace below, none above
_PACE_PER_S2 = 0.2  # change of pace: 0.02 m/s2 at 0.1 m/s
_WAY_SAMPLES = 65
_FILTER = SafetyFilterConfig()
"""What the filter behind every controller lets pass: who closes in at v has v / gain of room left to it."""
_STOPPING_GAP_M = 0.04  # what the filter keeps between hulls, and what estimates are off by


class TrajectoryConfig(PlainModel):
    """From where to where, and what is kept to.

    Attributes:
        ship: The own name; the rig's where it is left out.
        starts_m: Where each ship begins; the rig's poses to hold of all that fly this law where left out.
        places_m: Where they are to be.
        assign: ``as_listed``: the first ship gets the first place, and so on. ``squared_distance``,
            ``time``: at the least sum of these.
        duration_s: From rest to rest; left out, it is chosen.
        gap_m: Between two hulls.
        speed_m_s: Largest speed.
        acceleration_m_s2: Largest acceleration.
        braking_m_s2: What every ship's valves can be counted on for.
        obstacles_m: x, y, radius of each.
        station: Of the law that follows the plan.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    ship: str = ""
    starts_m: dict[str, Vector2] = Field(default_factory=dict)
    places_m: tuple[Vector2, ...] = Field(min_length=1)
    assign: Literal["as_listed", "squared_distance", "time"] = "as_listed"
    duration_s: float | None = Field(default=None, gt=0.0, le=3600.0)
    gap_m: float = Field(default=0.12, ge=0.02, le=2.0)
    speed_m_s: float = Field(default=0.10, gt=0.0, le=1.0)
    acceleration_m_s2: float = Field(default=0.015, gt=0.0, le=1.0)
    braking_m_s2: float = Field(default=0.025, gt=0.0, le=1.0)
    obstacles_m: tuple[tuple[float, float, float], ...] = ()
    station: StationConfig = StationConfig()

    def asked(self, keep_in: KeepIn | None) -> "Reconfiguration":
        """What is to be planned; ships in the order of their names in `starts_m`.

        Raises:
            ValueError: There are fewer places than ships.
        """
        # half a second of SciPy, which rigs without a plan need not have
        from groundstation.control.assignment import assign
        from groundstation.control.trajectories import Margins, Reconfiguration

        cost = "squared_distance" if self.assign == "as_listed" else self.assign
        chosen = assign(  # refuses fewer places, too
            self.starts_m,
            self.places_m,
            cost,
            speed_m_s=self.speed_m_s,
            acceleration_m_s2=self.acceleration_m_s2,
        )
        if self.assign == "as_listed":
            chosen = {name: number for number, name in enumerate(self.starts_m)}
        margins = Margins(
            gap_m=self.gap_m,
            stopping_gap_m=min(_STOPPING_GAP_M, self.gap_m),
            edge_gap_m=_STOPPING_GAP_M,
            speed_m_s=self.speed_m_s,
            acceleration_m_s2=self.acceleration_m_s2,
            braking_m_s2=self.braking_m_s2,
            reaction_s=_FILTER.reaction_s + _FILTER.reserve_s + 1.0 / _FILTER.gain_per_s,
        )
        return Reconfiguration(
            tuple(self.starts_m.values()),
            tuple(self.places_m[chosen[name]] for name in self.starts_m),
            keep_in,
            self.obstacles_m,
            margins,
            self.duration_s,
        )


class Trajectory:
    """Controller row ``trajectory``.

    Raises:
        ValueError: The own ship is none of those that start, its valves are too weak for the plan, or there
            is no safe plan.
    """

    def __init__(
        self, config: TrajectoryConfig, vehicle: VehicleModel, keep_in: KeepIn | None = None
    ) -> None:
        names = tuple(config.starts_m)
        if config.ship not in names:
            raise ValueError(
                f"starts_m: {config.ship!r} is none of the ships that start ({', '.join(names)})"
            )
        envelope = WrenchEnvelope(vehicle)
        thrust_m_s2 = envelope.max_force_n / vehicle.mass_kg
        braking_m_s2 = _FILTER.share_of_braking * braking_to_count_on(vehicle, envelope)
        if config.acceleration_m_s2 > _MOST_OF_THE_VALVES * thrust_m_s2:
            raise ValueError(
                f"acceleration_m_s2: {config.acceleration_m_s2:g} is more than the "
                f"{_MOST_OF_THE_VALVES * thrust_m_s2:.3f} m/s2 that its valves give with reserve"
            )
        if config.braking_m_s2 > braking_m_s2:
            raise ValueError(
                f"braking_m_s2: {config.braking_m_s2:g} is more than the {braking_m_s2:.3f} m/s2 to count on"
            )
        self._own, self._numbers = config.ship, {name: number for number, name in enumerate(names)}
        from groundstation.control.planning import plan  # likewise

        self._plan = plan(config.asked(keep_in))
        t_s = np.linspace(0.0, self._plan.duration_s, _WAY_SAMPLES)
        self._ways_m = np.moveaxis(self._plan.sampled(t_s), 1, 0)
        self._go_to = GoTo(GoToConfig(station=config.station), vehicle, keep_in)
        self._station = StationKeeping(config.station, vehicle)
        self.reset()

    @property
    def plan(self) -> "Plan":
        """What is flown; ships in the order of their names."""
        return self._plan

    def reset(self) -> None:
        """Forget where on the plan it was: the next update begins, from the start or at the end."""
        self._go_to.reset()
        self._station.reset()
        self._phase_s: float | None = None
        self._pace = 0.0
        self._change_per_s = 0.0
        self._held: Goal | None = None
        self._reference: Goal | None = None

    def setpoint(self, goal: Goal) -> Goal:
        """Where the plan is; the goal before the first update."""
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
        """See `Controller.update`; of the goal, the heading is kept."""
        state, goal, span_s = state.bounded(), goal.bounded(), span_of(dt_s)
        at_m = {name: neighbours[name].bounded() for name in self._numbers if name in neighbours}
        at_m[self._own] = state
        if self._phase_s is None:
            self._phase_s = self._begun(at_m)
        if self._phase_s is None:
            self._reference = self._waiting(state, goal)
            return self._go_to.update(state, self._reference, dt_s, applied=applied)
        self._advance(at_m, span_s)
        self._reference = self._on_plan(goal)
        return self._station.update(state, self._reference, dt_s, applied=applied)

    def _begun(self, at_m: Mapping[str, ControlState]) -> float | None:
        """Where on the plan to begin; None while it has to wait."""
        own = at_m[self._own]
        number = self._numbers[self._own]
        start_m, end_m = self._ways_m[number][0], self._ways_m[number][-1]
        if math.hypot(*own.velocity_table_m_s) > _BEGIN_M_S:
            return None
        if math.dist(own.position_table_m, start_m) > _BEGIN_M:
            # armed anew at its place, it stays there
            is_there = math.dist(own.position_table_m, end_m) < _BEGIN_M
            return self._plan.duration_s if is_there else None
        for name, number in self._numbers.items():
            if name not in at_m:
                return None
            off_m = np.hypot(*(self._ways_m[number] - at_m[name].position_table_m).T).min()
            if off_m > _OTHERS_M:
                return None
        return 0.0

    def _waiting(self, state: ControlState, goal: Goal) -> Goal:
        """The start if it is near, otherwise the place where it was first seen."""
        x, y = self._ways_m[self._numbers[self._own]][0].tolist()
        if self._held is None:
            here = state.position_table_m
            self._held = Goal((x, y) if math.dist(here, (x, y)) < _CAPTURE_M else here, goal.heading_rad)
        return replace(self._held, heading_rad=goal.heading_rad)

    def _advance(self, at_m: Mapping[str, ControlState], span_s: float) -> None:
        """Carry the phase on, at the pace of who lags farthest."""
        assert self._phase_s is not None
        places_m, velocities_m_s, _ = self._plan.at(self._phase_s)
        lag_m = max(
            _lag_m(at_m.get(name), tuple(places_m[number].tolist()), tuple(velocities_m_s[number].tolist()))
            for name, number in self._numbers.items()
        )
        wanted = (_LAG_STOP_M - lag_m) / (_LAG_STOP_M - _LAG_FREE_M)
        step = _PACE_PER_S2 * span_s
        before = self._pace
        self._pace += clamp(min(max(wanted, 0.0), 1.0) - before, step)
        self._change_per_s = (self._pace - before) / span_s
        self._phase_s = min(self._phase_s + 0.5 * (before + self._pace) * span_s, self._plan.duration_s)

    def _on_plan(self, goal: Goal) -> Goal:
        assert self._phase_s is not None
        number = self._numbers[self._own]
        (x, y), (vx, vy), (ax, ay) = (values[number].tolist() for values in self._plan.at(self._phase_s))
        pace, change = self._pace, self._change_per_s
        if self._phase_s >= self._plan.duration_s:
            return Goal((x, y), goal.heading_rad)
        return Goal(
            (x, y),
            goal.heading_rad,
            (pace * vx, pace * vy),
            0.0,
            (pace**2 * ax + change * vx, pace**2 * ay + change * vy),
        )


def _lag_m(state: ControlState | None, place_m: Vector2, velocity_m_s: Vector2) -> float:
    """How far a ship is behind its place on the plan, or beside it; infinite where it is not seen."""
    if state is None:
        return math.inf
    off = (state.position_table_m[0] - place_m[0], state.position_table_m[1] - place_m[1])
    speed = math.hypot(*velocity_m_s)
    if speed <= 0.0:
        return 0.0
    ahead_m = (off[0] * velocity_m_s[0] + off[1] * velocity_m_s[1]) / speed
    aside_m = abs(off[0] * velocity_m_s[1] - off[1] * velocity_m_s[0]) / speed
    return max(-ahead_m, aside_m)
