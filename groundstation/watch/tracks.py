"""What the pictures of a report draw of each vehicle, as arrays."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from groundstation.declarations.message import Message
from groundstation.declarations.view import Wanted
from groundstation.parts.control.messages import ControlStatus
from groundstation.parts.fusion.messages import FixAccount, VehicleState
from groundstation.parts.operation.messages import Latency
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.supervision.messages import Supervision
from groundstation.parts.valves.messages import ValveCommand, ValveStatus

Array = NDArray[np.float64]
DRAWN: tuple[type[Message], ...] = (Supervision, FixAccount, Latency)
"""Classes of which a track takes each message."""
DRAWN_COLUMNS: Final[Wanted] = {
    ReferenceState: ("position_table_m", "heading_rad"),
    VehicleState: ("position_table_m", "heading_rad", "pose_sigma"),
    ControlStatus: ("goal_position_table_m", "goal_heading_rad"),
    ValveCommand: ("on_time_ms",),
    ValveStatus: ("pressure_pa",),
}
"""Classes of which it takes fields."""


@dataclass(slots=True)
class Track:
    """Everything of one vehicle that is drawn; times in s since the recording began.

    Attributes:
        truth: Rows of t, x, y, heading (unwrapped); shape (n, 4).
        state: Rows of t, x, y, heading, and standard deviations of x, y, heading; shape (n, 7).
        goal: Setpoint of the controller, rows of t, x, y, heading; shape (n, 4).
        on_times: Rows of t and remaining on-time (s) of each valve, as the guard let them;
            shape (n, 1 + valves).
        pressure: Rows of t, tank pressure (Pa) where it is known; shape (n, 2).
        accounts: Rows of t, used (1 or 0), innovation x, y (m), heading (rad), NIS; shape (n, 6).
        account_reasons: Reason of each of these rows.
        account_sources: Source of each of these rows.
        modes: Moment and mode of each change.
        flying_since_s: When its newest flight began; NaN if it never flew.
        latency: The newest summary.
    """

    truth: Array
    state: Array
    goal: Array
    on_times: Array
    pressure: Array
    accounts: Array
    account_reasons: list[str]
    account_sources: list[str]
    modes: list[tuple[float, str]]
    flying_since_s: float
    latency: Latency | None


@dataclass(slots=True)
class TrackBuilder:
    """Collects the track of one vehicle."""

    _rows: dict[type[Message], Array] = field(default_factory=dict)
    _accounts: list[tuple[float, ...]] = field(default_factory=list)
    _reasons: list[str] = field(default_factory=list)
    _sources: list[str] = field(default_factory=list)
    _modes: list[tuple[float, str]] = field(default_factory=list)
    _is_flying: bool = False
    _flying_since_s: float = math.nan
    _latency: Latency | None = None

    def take(self, message: Message, t_s: float) -> None:
        """Account for a message of ``DRAWN``."""
        match message:
            case Supervision():
                was_flying, self._is_flying = self._is_flying, message.is_in_flight
                if self._is_flying and not was_flying:
                    self._flying_since_s = t_s
                if not self._modes or self._modes[-1][1] != message.mode:
                    self._modes.append((t_s, message.mode))
            case FixAccount():
                self._reasons.append(message.reason)
                self._sources.append(message.source)
                self._accounts.append((t_s, float(message.used), *message.innovation, message.nis))
            case Latency():
                self._latency = message

    def take_columns(self, kind: type[Message], t_s: Array, fields: Mapping[str, Array]) -> None:
        """Account for all messages of a class of ``DRAWN_COLUMNS``."""
        self._rows[kind] = np.column_stack([t_s, *(fields[name] for name in DRAWN_COLUMNS[kind])])

    def track(self) -> Track:
        """What was collected."""
        truth = self._of(ReferenceState, 4)
        truth[:, 3] = np.unwrap(truth[:, 3])
        on_times = self._of(ValveCommand, 9)
        on_times[:, 1:] *= 1e-3
        pressure = self._of(ValveStatus, 2)
        accounts = np.array(self._accounts, float).reshape(-1, 6)
        return Track(
            truth,
            self._of(VehicleState, 7),
            self._of(ControlStatus, 4),
            on_times,
            pressure[np.isfinite(pressure[:, 1])],
            accounts,
            self._reasons,
            self._sources,
            self._modes,
            self._flying_since_s,
            self._latency,
        )

    def _of(self, kind: type[Message], columns: int) -> Array:
        found = self._rows.get(kind)
        return np.empty((0, columns)) if found is None else found.astype(float)
