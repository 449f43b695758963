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
from typing import TYPE_CHECKING

import numpy as np

from groundstation.control.controller import NO_NEIGHBOURS, span_of
from groundstation.control.edge import braking_to_count_on
from groundstation.control.go_to import GoTo, GoToConfig
from groundstation.control.keep_in import KeepIn
from groundstation.control.pace import Pace, lag_m
from groundstation.control.state import BodyWrench, ControlState, Goal, Vector2
from groundstation.control.station import StationKeeping
from groundstation.control.trajectory_config import FILTER, TrajectoryConfig
from groundstation.control.vehicle import VehicleModel
from groundstation.control.wrench_envelope import WrenchEnvelope

if TYPE_CHECKING:
    from groundstation.control.trajectories import Plan

_MOST_OF_THE_VALVES = 0.6  # that a plan may ask for: the rest fights slope, noise and turning
_BEGIN_M, _BEGIN_M_S = 0.04, 0.015  # nearer to its start and slower than this, a ship may begin
_CAPTURE_M = 0.25  # from farther away than this nobody flies to a start: there is no plan for that way
_OTHERS_M = 0.12  # so near to its way another ship is when one begins
_WAY_SAMPLES = 65
_FALLEN_S = 2.0  # so long a ship is down, and the others at their places, before one moves up


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
        braking_m_s2 = FILTER.share_of_braking * braking_to_count_on(vehicle, envelope)
        if config.acceleration_m_s2 > _MOST_OF_THE_VALVES * thrust_m_s2:
            raise ValueError(
                f"acceleration_m_s2: {config.acceleration_m_s2:g} is more than the "
                f"{_MOST_OF_THE_VALVES * thrust_m_s2:.3f} m/s2 that its valves give with reserve"
            )
        if config.braking_m_s2 > braking_m_s2:
            raise ValueError(
                f"braking_m_s2: {config.braking_m_s2:g} is more than the {braking_m_s2:.3f} m/s2 to count on"
            )
        from groundstation.control.planning import plan  # half a second of SciPy

        self._own, self._config, self._keep_in = config.ship, config, keep_in
        self._all = (config.assigned(), plan(config.asked(keep_in)))
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
        self._take(*self._all)
        self._phase_s: float | None = None
        self._held: Goal | None = None
        self._reference: Goal | None = None
        self._fallen_m: dict[str, Vector2] = {}
        self._answered: frozenset[str] = frozenset()

    def see_fallen(self, places_m: Mapping[str, Vector2]) -> None:
        """See `KeepsPlaces.see_fallen`."""
        self._fallen_m = {name: place_m for name, place_m in places_m.items() if name != self._own}

    def _take(self, assigned: Mapping[str, int], plan: "Plan") -> None:
        """Fly a plan from its beginning; ships in the order of their names in `assigned`."""
        self._assigned, self._plan = dict(assigned), plan
        self._numbers = {name: number for number, name in enumerate(assigned)}
        self._ways_m = np.moveaxis(plan.sampled(np.linspace(0.0, plan.duration_s, _WAY_SAMPLES)), 1, 0)
        self._pace, self._fallen_s = Pace(), 0.0

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
        """Carry the phase on, at the pace of who lags farthest; at the end, fill what has fallen empty."""
        assert self._phase_s is not None
        if self._phase_s >= self._plan.duration_s:
            self._move_up(span_s)
        places_m, velocities_m_s, _ = self._plan.at(self._phase_s)
        late_m = max(
            lag_m(at_m.get(name), tuple(places_m[number].tolist()), tuple(velocities_m_s[number].tolist()))
            for name, number in self._numbers.items()
            if not self._is_out_of_the_way(name)
        )
        self._phase_s = min(self._pace.advanced(self._phase_s, late_m, span_s), self._plan.duration_s)

    def _is_out_of_the_way(self, name: str) -> bool:
        """Whether a ship has come down where nobody's way passes: it is not waited for."""
        if name not in self._fallen_m:
            return False
        margins = self._config.margins()
        off_m = np.hypot(*np.moveaxis(self._ways_m - self._fallen_m[name], -1, 0)).min(axis=1)
        near = off_m < 2.0 * margins.radius_m + margins.gap_m
        return not any(near[number] for other, number in self._numbers.items() if other != name)

    def _move_up(self, span_s: float) -> None:
        """Take the next plan once a ship has been down for long enough."""
        fallen = frozenset(self._fallen_m) & self._numbers.keys()
        if fallen != self._answered:
            self._answered, self._fallen_s = fallen, 0.0
        self._fallen_s += span_s
        if not fallen or self._config.empty == "keep" or not _FALLEN_S <= self._fallen_s < math.inf:
            return
        from groundstation.control.vacancies import moved_up

        self._fallen_s = math.inf  # once: what cannot be filled now stays empty until another one comes down
        found = moved_up(self._config, self._keep_in, self._assigned, self._fallen_m)
        if found is not None:
            self._take(*found)
            self._phase_s = 0.0

    def _on_plan(self, goal: Goal) -> Goal:
        assert self._phase_s is not None
        number = self._numbers[self._own]
        (x, y), (vx, vy), (ax, ay) = (values[number].tolist() for values in self._plan.at(self._phase_s))
        pace, change = self._pace.pace, self._pace.change_per_s
        if self._phase_s >= self._plan.duration_s:
            return Goal((x, y), goal.heading_rad)
        return Goal(
            (x, y),
            goal.heading_rad,
            (pace * vx, pace * vy),
            0.0,
            (pace**2 * ax + change * vx, pace**2 * ay + change * vy),
        )
