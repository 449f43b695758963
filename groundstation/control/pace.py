"""The pace at which ships fly a plan together: that of who lags farthest behind it."""

import math

from groundstation.control.state import ControlState, Vector2, clamp

LAG_FREE_M, LAG_STOP_M = 0.03, 0.09
"""Behind the plan: full pace below, none above."""
CHANGE_PER_S2 = 0.2
"""Of the pace: 0.02 m/s2 at 0.1 m/s."""


class Pace:
    """How fast the plan's own clock runs: 1 at most, 0 while somebody has to be waited for."""

    def __init__(self) -> None:
        self.pace = 0.0
        """Seconds of the plan for each second."""
        self.change_per_s = 0.0

    def advanced(self, phase_s: float, lag_m: float, span_s: float) -> float:
        """The phase after a span.

        Args:
            phase_s: Before it.
            lag_m: Of who is farthest behind; infinite where somebody is not seen.
            span_s: Its length.
        """
        wanted = (LAG_STOP_M - lag_m) / (LAG_STOP_M - LAG_FREE_M)
        before = self.pace
        self.pace += clamp(min(max(wanted, 0.0), 1.0) - before, CHANGE_PER_S2 * span_s)
        self.change_per_s = (self.pace - before) / span_s
        return phase_s + 0.5 * (before + self.pace) * span_s


def lag_m(state: ControlState | None, place_m: Vector2, velocity_m_s: Vector2) -> float:
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
