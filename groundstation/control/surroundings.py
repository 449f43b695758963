"""What stands around a mock-up: the others as they were reported last, and obstacles."""

import math
from dataclasses import dataclass, field

from groundstation.control.safety_filter import Disc
from groundstation.control.state import ControlState, Vector2

TOUCH_RESERVE_M = 0.02
"""Between two hulls, beside what is not known of their places."""
_SIGMAS = 3.0
_LARGEST_DOUBT_M = 0.15
_SILENT_S = 1.0
"""Who has not been reported for longer is taken to stand where he was seen last."""
_MOVING_M_S = 0.005


@dataclass(frozen=True, slots=True)
class Obstacle:
    """A round place that mock-ups keep out of, table axes."""

    name: str
    position_table_m: Vector2
    radius_m: float


@dataclass(slots=True)
class _Seen:
    arrival_ns: int
    state: ControlState
    doubt_m: float
    is_flown: bool


@dataclass(slots=True)
class Surroundings:
    """Keeps the newest report of every other mock-up.

    Attributes:
        radius_m: Of each mock-up.
        obstacles: What stands on the table.
    """

    radius_m: float
    obstacles: tuple[Obstacle, ...] = ()
    _seen: dict[str, _Seen] = field(default_factory=dict)

    def see(
        self, name: str, state: ControlState, sigma_m: tuple[float, float], now_ns: int, *, is_flown: bool
    ) -> None:
        """Take a report.

        Args:
            name: Of the other mock-up.
            state: Its state.
            sigma_m: Standard deviations of x and y.
            now_ns: Moment of the arrival.
            is_flown: It is in flight: its own filter keeps to its half of what is between both.
        """
        self._seen[name] = _Seen(now_ns, state, _doubt_m(sigma_m), is_flown)

    def others(self, now_ns: int) -> dict[str, ControlState]:
        """States of the others, carried to the present; who is silent stands."""
        return {name: _now(seen, now_ns)[0] for name, seen in self._seen.items()}

    def discs(self, own_sigma_m: tuple[float, float], now_ns: int, exempt: frozenset[str]) -> list[Disc]:
        """Everything round that must not be touched.

        Args:
            own_sigma_m: Standard deviations of this mock-up's own place.
            now_ns: The present.
            exempt: Names of those that may be touched: who docks with them.
        """
        own_m = _doubt_m(own_sigma_m)
        reach_m = 2.0 * self.radius_m + TOUCH_RESERVE_M
        found = []
        for name, seen in self._seen.items():
            if name in exempt:
                continue
            state, is_silent = _now(seen, now_ns)
            moves = math.hypot(*state.velocity_table_m_s) > _MOVING_M_S
            share = 0.5 if seen.is_flown and moves and not is_silent else 1.0
            doubt_m = math.hypot(own_m, seen.doubt_m)
            found.append(
                Disc(name, state.position_table_m, state.velocity_table_m_s, reach_m + doubt_m, share)
            )
        for obstacle in self.obstacles:
            reach_m = self.radius_m + obstacle.radius_m + TOUCH_RESERVE_M + own_m
            found.append(Disc(obstacle.name, obstacle.position_table_m, (0.0, 0.0), reach_m, 1.0))
        return found


def _doubt_m(sigma_m: tuple[float, float]) -> float:
    doubt_m = _SIGMAS * math.hypot(*sigma_m)
    return doubt_m if doubt_m < _LARGEST_DOUBT_M else _LARGEST_DOUBT_M  # so is one that is no number


def _now(seen: _Seen, now_ns: int) -> tuple[ControlState, bool]:
    age_s = 1e-9 * (now_ns - seen.arrival_ns)
    if age_s <= _SILENT_S:
        return seen.state.carried(age_s), False
    state = seen.state.carried(_SILENT_S)
    return ControlState(state.position_table_m, (0.0, 0.0), state.heading_rad, 0.0), True
