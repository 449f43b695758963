"""The way that the velocity of the own estimate adds up to: corrections of its pose are no motion."""

from collections import deque

from groundstation.fusion.state_memory import MEMORY_NS
from groundstation.parts.fusion.messages import VehicleState
from groundstation.relative_navigation.relative_filter import NS_PER_S, OwnMoment


class OwnWay:
    """Adds up the velocity of one vehicle, state by state."""

    def __init__(self) -> None:
        self._rows: deque[tuple[int, float, float, float, float]] = deque()  # stamp, way x, y, velocity x, y

    def remember(self, state: VehicleState) -> None:
        """Take the next state."""
        vx, vy = state.velocity_table_m_s
        x, y = 0.0, 0.0
        if self._rows:
            stamp_ns, x, y, vx_before, vy_before = self._rows[-1]
            half_s = 0.5 * (state.stamp_ns - stamp_ns) / NS_PER_S
            x, y = x + half_s * (vx + vx_before), y + half_s * (vy + vy_before)
        self._rows.append((state.stamp_ns, x, y, vx, vy))
        while state.stamp_ns - self._rows[0][0] > MEMORY_NS:
            self._rows.popleft()

    def moment(self, state: VehicleState) -> OwnMoment:
        """A state, remembered or between two that were, with the way up to it."""
        stamp_ns, x, y, vx, vy = self._rows[0]
        for row in reversed(self._rows):
            if row[0] <= state.stamp_ns:
                stamp_ns, x, y, vx, vy = row
                break
        half_s = 0.5 * (state.stamp_ns - stamp_ns) / NS_PER_S
        vx_then, vy_then = state.velocity_table_m_s
        way_m = (x + half_s * (vx + vx_then), y + half_s * (vy + vy_then))
        return OwnMoment(state.stamp_ns, way_m, state.heading_rad, (vx_then, vy_then), state.rate_rad_s)
