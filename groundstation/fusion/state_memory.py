"""Two seconds of states, and the state at any moment within them: late pictures ask for the past."""

from collections import deque
from dataclasses import replace
from typing import Any, Generic, Protocol, TypeVar

from groundstation.frames import wrap_angle

MEMORY_NS = 2_000_000_000
REACH_NS = 50_000_000
"""Between two states of 100 Hz there are 10 ms; farther than this the IMU has fallen silent."""


class PlanarMotion(Protocol):
    """What is remembered: a frozen dataclass with at least these fields."""

    @property
    def stamp_ns(self) -> int: ...
    @property
    def position_table_m(self) -> tuple[float, float]: ...
    @property
    def heading_rad(self) -> float: ...
    @property
    def velocity_table_m_s(self) -> tuple[float, float]: ...
    @property
    def rate_rad_s(self) -> float: ...
    @property
    def status(self) -> str: ...


S = TypeVar("S", bound=PlanarMotion)


class StateMemory(Generic[S]):
    """Keeps states of a filter that is not lost."""

    def __init__(self) -> None:
        self._states: deque[S] = deque()

    def remember(self, state: S) -> None:
        """Take the next state; a lost filter's empties the memory."""
        states = self._states
        if state.status != "flying":
            states.clear()
            return
        states.append(state)
        while state.stamp_ns - states[0].stamp_ns > MEMORY_NS:
            states.popleft()

    def at(self, stamp_ns: int) -> S | None:
        """The state at a moment: between its neighbours, or the newest carried on; None if none is near."""
        after = None
        for before in reversed(self._states):
            if before.stamp_ns <= stamp_ns:
                return _between(before, after, stamp_ns)
            after = before
        return None


def _between(before: S, after: S | None, stamp_ns: int) -> S | None:
    if stamp_ns - before.stamp_ns > REACH_NS:
        return None
    span_s = (stamp_ns - before.stamp_ns) * 1e-9
    (x, y), (vx, vy), rate = before.position_table_m, before.velocity_table_m_s, before.rate_rad_s
    share = 0.0
    if after is not None and after.stamp_ns - before.stamp_ns <= REACH_NS:
        share = (stamp_ns - before.stamp_ns) / (after.stamp_ns - before.stamp_ns)
        # What the neighbours' means say more than the velocity alone: a fix that came between, a push.
        whole_s = (after.stamp_ns - before.stamp_ns) * 1e-9
        x += share * (after.position_table_m[0] - x - vx * whole_s)
        y += share * (after.position_table_m[1] - y - vy * whole_s)
        turn = after.heading_rad - before.heading_rad - rate * whole_s
        heading = before.heading_rad + share * wrap_angle(turn)
        vx += share * (after.velocity_table_m_s[0] - vx)
        vy += share * (after.velocity_table_m_s[1] - vy)
        rate_then = rate + share * (after.rate_rad_s - rate)
    else:
        heading, rate_then = before.heading_rad, rate
    (vx0, vy0) = before.velocity_table_m_s
    dataclass: Any = before  # a protocol cannot say that it is one
    moved: S = replace(
        dataclass,
        stamp_ns=stamp_ns,
        position_table_m=(x + vx0 * span_s, y + vy0 * span_s),
        velocity_table_m_s=(vx, vy),
        heading_rad=wrap_angle(heading + rate * span_s),
        rate_rad_s=rate_then,
    )
    return moved
