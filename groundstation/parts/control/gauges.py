"""What people are shown of station keeping: the distance to the controller's own setpoint."""

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from groundstation.declarations.message import Message
from groundstation.declarations.readings import RecentErrors, column, distance, pose_cell
from groundstation.declarations.view import Cell, Figure, Gauge, GaugeRow, Newest, Wanted
from groundstation.parts.control.messages import ControlStatus
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.supervision.messages import Supervision

SETTLING_S = 20.0
"""Left out of the report's numbers after the vehicle began to fly."""

Array = NDArray[np.float64]


class OffGoalGauge(Gauge):
    """Distance of the estimate from the setpoint, now."""

    label = "off its goal"
    newest = (VehicleState, ControlStatus)

    def cell(self, newest: Newest, now_ns: int) -> Cell:
        del now_ns
        return pose_cell(*_off_goal(newest))

    def phrase(self, newest: Newest, now_ns: int) -> str:
        del now_ns
        position_m, heading_rad = _off_goal(newest)
        return f"off {column(position_m * 1e3, 6, 1)} mm {column(math.degrees(heading_rad), 6, 2)} deg"


class StationGauge(Gauge):
    """Distance of the truth from the setpoint while flying, over the last seconds."""

    label = "  rms of 30 s, by truth"
    every = (ReferenceState, ControlStatus, Supervision)

    def __init__(self, vehicle: str) -> None:
        super().__init__(vehicle)
        self._goal: ControlStatus | None = None
        self._is_flying = False
        self._errors = RecentErrors()

    def take(self, message: Message, now_ns: int) -> tuple[str, ...]:
        if isinstance(message, ReferenceState):
            goal = self._goal
            if goal is not None and self._is_flying:
                apart = distance(
                    message.position_table_m,
                    message.heading_rad,
                    goal.goal_position_table_m,
                    goal.goal_heading_rad,
                )
                self._errors.add(now_ns, *apart)
        elif isinstance(message, ControlStatus):
            self._goal = message
        elif isinstance(message, Supervision):
            self._is_flying = message.is_in_flight
        return ()

    def cell(self, newest: Newest, now_ns: int) -> Cell:
        del newest, now_ns
        return pose_cell(*self._errors.rms())


class StationFigure(Figure):
    """Station keeping by truth, from ``SETTLING_S`` after the vehicle began to fly."""

    inputs = (Supervision,)
    columns: ClassVar[Wanted] = {
        ReferenceState: ("position_table_m", "heading_rad"),
        ControlStatus: ("goal_position_table_m", "goal_heading_rad"),
    }

    def __init__(self) -> None:
        self._truth = self._goal = np.empty((0, 4))
        self._is_flying = False
        self._flying_since_s = math.nan

    def take(self, message: Message, t_s: float) -> None:
        assert isinstance(message, Supervision)
        was_flying, self._is_flying = self._is_flying, message.is_in_flight
        if self._is_flying and not was_flying:
            self._flying_since_s = t_s

    def take_columns(self, kind: type[Message], t_s: Array, fields: Mapping[str, Array]) -> None:
        rows = np.column_stack([t_s, *(fields[name] for name in self.columns[kind])])
        if kind is ReferenceState:
            self._truth = rows
        else:
            self._goal = rows

    def values(self) -> dict[str, Any]:
        since_s = self._flying_since_s + SETTLING_S
        t, position_m, heading_rad = station_errors(self._truth, self._goal, since_s).T
        if not t.size:
            t, position_m, heading_rad = np.zeros(1), np.full(1, np.nan), np.full(1, np.nan)
        return {
            "flying_since_s": self._flying_since_s,
            "settled_for_s": float(np.ptp(t)),
            "station_position_rms_mm": 1e3 * math.sqrt(np.mean(position_m**2)),
            "station_position_max_mm": 1e3 * float(np.max(position_m)),
            "station_heading_rms_deg": math.degrees(math.sqrt(np.mean(heading_rad**2))),
        }


def station_errors(truth: Array, goal: Array, since_s: float) -> Array:
    """Truth against the setpoint in force from a moment on.

    Args:
        truth: Rows of t (s), x, y (m), heading (rad), ...; shape (n, 4 or more).
        goal: Rows of t (s), x, y (m), heading (rad); shape (m, 4).
        since_s: What came before is left out; NaN leaves out everything.

    Returns:
        Rows of t (s), distance (m), turn (rad); shape (k, 3).
    """
    truth = truth[truth[:, 0] >= since_s]
    if not len(goal) or not len(truth):
        return np.empty((0, 3))
    newest = np.searchsorted(goal[:, 0], truth[:, 0], side="right").clip(1, len(goal)) - 1
    in_force = goal[newest]
    apart = np.hypot(truth[:, 1] - in_force[:, 1], truth[:, 2] - in_force[:, 2])
    turn = (truth[:, 3] - in_force[:, 3] + math.pi) % math.tau - math.pi
    return np.column_stack([truth[:, 0], apart, turn])


def _off_goal(newest: Newest) -> tuple[float, float]:
    """Estimate to setpoint, m and rad; NaN without either."""
    state, goal = newest.get(VehicleState), newest.get(ControlStatus)
    if state is None or goal is None:
        return math.nan, math.nan
    return distance(
        state.position_table_m, state.heading_rad, goal.goal_position_table_m, goal.goal_heading_rad
    )


GAUGES = (GaugeRow(50, OffGoalGauge), GaugeRow(60, StationGauge))
