"""How another mock-up accelerates, found from its velocity.

A state carries no acceleration, and a follower that is told of a leader's velocity only comes behind by
a / k whenever the leader speeds up: 22 mm for 15 mm/s^2 at a stiffness of 0.67 per s^2. The observer that
finds a mock-up's own disturbance finds the acceleration of another one, of which no push is known.
"""

from dataclasses import dataclass

from groundstation.control.observer import DisturbanceObserver
from groundstation.control.state import ControlState, Vector2

BANDWIDTH_RAD_S = 4.0
"""Faster passes the leader's single pulses, slower comes too late: about 0.5 s behind a change."""
LARGEST_M_S2, LARGEST_RAD_S2 = 0.1, 1.0
"""Beyond what valves do to a mock-up: the estimate jumped."""


@dataclass(frozen=True, slots=True)
class Acceleration:
    """Of a mock-up: of its centre of mass in the table frame (m/s^2), and of its heading (rad/s^2)."""

    table_m_s2: Vector2 = (0.0, 0.0)
    turn_rad_s2: float = 0.0


AT_REST = Acceleration()


class MotionWatch:
    """Watches one mock-up."""

    def __init__(self) -> None:
        self._x = DisturbanceObserver(BANDWIDTH_RAD_S, LARGEST_M_S2)
        self._y = DisturbanceObserver(BANDWIDTH_RAD_S, LARGEST_M_S2)
        self._turn = DisturbanceObserver(BANDWIDTH_RAD_S, LARGEST_RAD_S2)

    def update(self, state: ControlState, dt_s: float) -> Acceleration:
        """Take its newest state.

        Args:
            state: Carried to the present.
            dt_s: Since the last one.
        """
        self._x.update(state.velocity_table_m_s[0], 0.0, dt_s)
        self._y.update(state.velocity_table_m_s[1], 0.0, dt_s)
        self._turn.update(state.rate_rad_s, 0.0, dt_s)
        return Acceleration((self._x.disturbance, self._y.disturbance), self._turn.disturbance)
