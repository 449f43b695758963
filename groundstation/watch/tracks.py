"""What the figures of a report draw of each vehicle, as arrays."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from groundstation.declarations.message import Message
from groundstation.parts.control.messages import ControlStatus
from groundstation.parts.fusion.messages import FixAccount, VehicleState
from groundstation.parts.operation.messages import Latency
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.supervision.messages import Supervision
from groundstation.parts.valves.messages import ValveCommand

Array = NDArray[np.float64]
DRAWN: tuple[type[Message], ...] = (
    ReferenceState,
    VehicleState,
    ControlStatus,
    ValveCommand,
    Supervision,
    FixAccount,
    Latency,
)


@dataclass(slots=True)
class Track:
    """Everything of one vehicle that figures draw; times in s since the recording began.

    Attributes:
        truth: Rows of t, x, y, heading (unwrapped); shape (n, 4).
        state: Rows of t, x, y, heading, and standard deviations of x, y, heading; shape (n, 7).
        goal: Setpoint of the controller, rows of t, x, y, heading; shape (n, 4).
        open_masks: Rows of t, open mask; shape (n, 2).
        accounts: Rows of t, used (1 or 0), innovation x, y (m), heading (rad), NIS; shape (n, 6).
        account_reasons: Reason of each of these rows.
        flying_since_s: When its newest flight began; NaN if it never flew.
        latency: The newest summary.
    """

    truth: Array
    state: Array
    goal: Array
    open_masks: Array
    accounts: Array
    account_reasons: list[str]
    flying_since_s: float
    latency: Latency | None


@dataclass(slots=True)
class TrackBuilder:
    """Collects the track of one vehicle from its messages."""

    _truth: list[tuple[float, ...]] = field(default_factory=list)
    _state: list[tuple[float, ...]] = field(default_factory=list)
    _goal: list[tuple[float, ...]] = field(default_factory=list)
    _masks: list[tuple[float, ...]] = field(default_factory=list)
    _accounts: list[tuple[float, ...]] = field(default_factory=list)
    _reasons: list[str] = field(default_factory=list)
    _is_flying: bool = False
    _flying_since_s: float = math.nan
    _latency: Latency | None = None

    def take(self, message: Message, t_s: float) -> None:
        """Account for a message of ``DRAWN``."""
        match message:
            case ReferenceState():
                self._truth.append((t_s, *message.position_table_m, message.heading_rad))
            case VehicleState():
                pose = (*message.position_table_m, message.heading_rad)
                self._state.append((t_s, *pose, *message.pose_sigma))
            case ControlStatus():
                self._goal.append((t_s, *message.goal_position_table_m, message.goal_heading_rad))
            case ValveCommand():
                self._masks.append((t_s, float(message.open_mask)))
            case Supervision():
                was_flying, self._is_flying = self._is_flying, message.is_in_flight
                if self._is_flying and not was_flying:
                    self._flying_since_s = t_s
            case FixAccount():
                self._reasons.append(message.reason)
                self._accounts.append((t_s, float(message.used), *message.innovation, message.nis))
            case Latency():
                self._latency = message

    def track(self) -> Track:
        """What was collected so far."""
        truth = _rows(self._truth, 4)
        truth[:, 3] = np.unwrap(truth[:, 3])
        return Track(
            truth,
            _rows(self._state, 7),
            _rows(self._goal, 4),
            _rows(self._masks, 2),
            _rows(self._accounts, 6),
            self._reasons,
            self._flying_since_s,
            self._latency,
        )


def _rows(found: list[tuple[float, ...]], columns: int) -> Array:
    return np.array(found, float).reshape(-1, columns)
