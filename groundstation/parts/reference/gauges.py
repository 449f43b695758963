"""What people are shown of the estimate against truth."""

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from groundstation.declarations.message import Message
from groundstation.declarations.readings import RecentErrors, column, distance, pose_cell
from groundstation.declarations.view import Cell, Figure, Gauge, GaugeRow, Newest, Wanted
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.supervision.messages import Supervision

SETTLING_S = 20.0
"""Left out of the report's numbers after the vehicle began to fly."""

Array = NDArray[np.float64]


class EstimateGauge(Gauge):
    """Distance of the estimate from the truth at the moment of the truth, over the last seconds."""

    label = "estimate, rms by truth"
    every = (ReferenceState, VehicleState)

    def __init__(self, vehicle: str) -> None:
        super().__init__(vehicle)
        self._state: VehicleState | None = None
        self._errors = RecentErrors()

    def take(self, message: Message, now_ns: int) -> tuple[str, ...]:
        if isinstance(message, VehicleState):
            self._state = message
        elif isinstance(message, ReferenceState):
            self._compare(message, now_ns)
        return ()

    def _compare(self, truth: ReferenceState, now_ns: int) -> None:
        state = self._state
        if state is None or state.status != "flying":
            return
        age_s = (truth.stamp_ns - state.stamp_ns) * 1e-9
        (x_m, y_m), (vx_m_s, vy_m_s) = state.position_table_m, state.velocity_table_m_s
        carried_m = (x_m + vx_m_s * age_s, y_m + vy_m_s * age_s)
        heading_rad = state.heading_rad + state.rate_rad_s * age_s
        apart = distance(truth.position_table_m, truth.heading_rad, carried_m, heading_rad)
        self._errors.add(now_ns, *apart)

    def cell(self, newest: Newest, now_ns: int) -> Cell:
        del newest, now_ns
        return pose_cell(*self._errors.rms())

    def phrase(self, newest: Newest, now_ns: int) -> str:
        del newest, now_ns
        position_m, heading_rad = self._errors.rms()
        return f"est {column(position_m * 1e3, 5, 2)} mm {column(math.degrees(heading_rad), 5, 3)} deg"


class EstimateFigure(Figure):
    """The estimate against truth, from ``SETTLING_S`` after the vehicle began to fly."""

    inputs = (Supervision,)
    columns: ClassVar[Wanted] = {
        ReferenceState: ("position_table_m", "heading_rad"),
        VehicleState: ("position_table_m", "heading_rad"),
    }

    def __init__(self) -> None:
        self._truth = self._state = np.empty((0, 4))
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
            self._state = rows

    def values(self) -> dict[str, Any]:
        truth, state = self._truth.copy(), self._state
        truth[:, 3] = np.unwrap(truth[:, 3])
        errors = estimate_errors(state[state[:, 0] >= self._flying_since_s + SETTLING_S], truth)
        _, dx, dy, turn = (errors if len(errors) else np.full((1, 4), np.nan)).T
        return {
            "estimate_position_rms_mm": 1e3 * math.sqrt(np.mean(dx**2 + dy**2)),
            "estimate_heading_rms_deg": math.degrees(math.sqrt(np.mean(turn**2))),
        }


def estimate_errors(state: Array, truth: Array) -> Array:
    """Estimate against truth at the estimate's stamps.

    Args:
        state: Rows of t (s), x, y (m), heading (rad), ...; shape (n, 4 or more).
        truth: Rows of t (s), x, y (m), heading (rad, unwrapped), ...; shape (m, 4 or more).

    Returns:
        Rows of t (s), dx, dy (m), turn (rad); shape (k, 4).
    """
    if len(truth) < 2:
        return np.empty((0, 4))
    t = state[:, 0]
    inside = state[(t >= truth[0, 0]) & (t <= truth[-1, 0])]
    x, y, heading = (np.interp(inside[:, 0], truth[:, 0], truth[:, i]) for i in (1, 2, 3))
    turn = (inside[:, 3] - heading + math.pi) % math.tau - math.pi
    return np.column_stack([inside[:, 0], inside[:, 1] - x, inside[:, 2] - y, turn])


GAUGES = (GaugeRow(70, EstimateGauge),)
