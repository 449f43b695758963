"""A law that flies to a place which others decide: what formation and follower have in common.

While nobody says where that is, the last place is held at rest; before anybody did, the place where the
mock-up is.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import replace

from groundstation.control.controller import NO_NEIGHBOURS, span_of
from groundstation.control.go_to import GoTo, GoToConfig
from groundstation.control.keep_in import KeepIn
from groundstation.control.motion_watch import AT_REST, Acceleration, MotionWatch
from groundstation.control.state import BodyWrench, ControlState, Goal
from groundstation.control.vehicle import VehicleModel


class AtSetpoint(ABC):
    """Base of such laws.

    Args:
        config: How to get there.
        vehicle: The mock-up.
        keep_in: Part of the table that it keeps to.

    Attributes:
        span_s: Since the update before.
    """

    def __init__(self, config: GoToConfig, vehicle: VehicleModel, keep_in: KeepIn | None) -> None:
        self._go_to = GoTo(config, vehicle, keep_in)
        self.span_s = 0.0
        self.reset()

    @abstractmethod
    def wanted(self, state: ControlState, goal: Goal, neighbours: Mapping[str, ControlState]) -> Goal | None:
        """Where the neighbours want it; None when none of them is known."""

    def reset(self) -> None:
        """Forget way, disturbances and the last setpoint."""
        self._go_to.reset()
        self._held: Goal | None = None
        self._watches: dict[str, MotionWatch] = {}
        self._accelerations: dict[str, Acceleration] = {}

    def acceleration_of(self, neighbour: str) -> Acceleration:
        """How a neighbour accelerates; at rest until it has been seen twice."""
        return self._accelerations.get(neighbour, AT_REST)

    def setpoint(self, goal: Goal) -> Goal:
        """Where the neighbours want it; the goal before the first update."""
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
        """See `Controller.update`."""
        self.span_s = span_of(dt_s)
        self._watch(neighbours, self.span_s)
        state = state.bounded()
        setpoint = self.wanted(state, goal.bounded(), neighbours)
        if setpoint is None:
            setpoint = self._held or Goal(state.position_table_m, state.heading_rad)
            setpoint = replace(setpoint, velocity_table_m_s=(0.0, 0.0), rate_rad_s=0.0)
            setpoint = replace(setpoint, acceleration_table_m_s2=(0.0, 0.0), angular_acceleration_rad_s2=0.0)
        self._held = setpoint
        return self._go_to.update(state, setpoint, dt_s, applied=applied)

    def _watch(self, neighbours: Mapping[str, ControlState], dt_s: float) -> None:
        """Find the neighbours' accelerations; who was silent is watched anew."""
        self._watches = {name: self._watches.get(name) or MotionWatch() for name in neighbours}
        self._accelerations = {
            name: watch.update(neighbours[name].bounded(), dt_s) for name, watch in self._watches.items()
        }
