"""Braking to rest, then holding the place: the one command that is always there.

The brake law takes speed away and no more: on a table that is not level it creeps downhill at the speed that
it calls rest. So once it is at rest, the place is held by station keeping, which learns the slope. Where no
state comes, braking goes on by dead reckoning; a place cannot be held by it.
"""

import math
from collections.abc import Callable

from groundstation.control.brake import BrakeConfig, brake_wrench, dead_reckoned
from groundstation.control.state import NO_WRENCH, BodyWrench, ControlState, Goal, Vector2
from groundstation.control.station import StationConfig, StationKeeping
from groundstation.control.vehicle import VehicleModel
from groundstation.control.wrench_envelope import WrenchEnvelope

AT_REST_M_S, AT_REST_RAD_S = 0.008, math.radians(2.0)
"""Slower, the place is held."""
MOVED_M_S, MOVED_RAD_S = 0.04, math.radians(8.0)
"""Faster, it was pushed: the speed is taken away first."""

Place = Callable[[Vector2, int], Vector2]
"""Where to hold, by where and when it came to rest: far enough from what must not be touched."""


def there(position_table_m: Vector2, now_ns: int) -> Vector2:
    """The place at which it came to rest."""
    del now_ns
    return position_table_m


class Braking:
    """Brakes on the newest state; where none comes for longer than a period, on dead reckoning.

    Args:
        config: The brake law.
        model: Mass properties.
        envelope: What the valves can make.
        period_ns: Of the modulation.

    Attributes:
        envelope: See above; it changes where valves fail.
        state: The newest state, or what was reckoned from it; None before the first.
        held: The pose that is held; None while it brakes.
    """

    def __init__(
        self,
        config: BrakeConfig,
        model: VehicleModel,
        envelope: WrenchEnvelope,
        period_ns: int,
    ) -> None:
        self._config, self._model, self._period_ns = config, model, period_ns
        self._station = StationKeeping(StationConfig(), model)
        self.envelope = envelope
        self.state: ControlState | None = None
        self.held: Goal | None = None
        self._state_ns: int  # of the state, so there is none before the first
        self._delivered = NO_WRENCH

    def take(self, state: ControlState, now_ns: int) -> None:
        """Take a state that arrived."""
        self.state, self._state_ns = state, now_ns

    def deliver(self, delivered: BodyWrench) -> None:
        """Note what the pulses of this period are expected to give."""
        self._delivered = delivered

    def begin(self) -> None:
        """Another source had the valves: what was held is of no meaning."""
        self.held = None

    def wrench(self, now_ns: int, place: Place = there) -> BodyWrench | None:
        """What brakes or holds in the period that begins now; None where no state ever came."""
        if self.state is None:
            return None
        if now_ns - self._state_ns > self._period_ns:
            self.held = None
            self.state = dead_reckoned(self.state, self._delivered, 1e-9 * self._period_ns, self._model)
        else:
            self._settle(self.state, place, now_ns)
        if self.held is None:
            return brake_wrench(self.state, self._config, self._model, self.envelope)
        return self._station.update(self.state, self.held, 1e-9 * self._period_ns, applied=self._delivered)

    def _settle(self, state: ControlState, place: Place, now_ns: int) -> None:
        """Hold from rest on; after a push brake again."""
        speed_m_s, rate_rad_s = math.hypot(*state.velocity_table_m_s), abs(state.rate_rad_s)
        if self.held is None and speed_m_s < AT_REST_M_S and rate_rad_s < AT_REST_RAD_S:
            self._station.reset()
            self.held = Goal(place(state.position_table_m, now_ns), state.heading_rad)
        elif speed_m_s > MOVED_M_S or rate_rad_s > MOVED_RAD_S:
            self.held = None
