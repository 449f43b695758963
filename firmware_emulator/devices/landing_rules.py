"""When a valve node lands by itself, and what it refuses then: rules 2 and 6 of the valve bus' document."""

from drivers.valve_bus.protocol import SILENCE_LANDS_S
from firmware_emulator.plant.thrusters import FAR_FUTURE_NS, NS_PER_S

_LANDS_NS = round(SILENCE_LANDS_S * NS_PER_S)


class LandingRules:
    """Stops with their grace, and the silence of commands.

    Landing is the node's business: it closes all valves, cuts the float air and disarms.

    Args:
        start_ns: Power-up, from when the silence counts.

    Attributes:
        is_stopped: A stop has landed the node and no Arm frame came since.
        is_landed_by_silence: Silence has, and neither an Arm frame nor FloatAir on was obeyed since.
    """

    def __init__(self, start_ns: int) -> None:
        self.is_stopped = self.is_landed_by_silence = False
        self._stops_ns = FAR_FUTURE_NS  # when the grace of a pending stop is over
        self._silent_ns = start_ns + _LANDS_NS  # when the silence is too long; far while it is
        self._received_counter: int | None = None

    @property
    def next_ns(self) -> int:
        """When the node lands by itself if nothing is received before."""
        return min(self._stops_ns, self._silent_ns)

    @property
    def is_stop_pending(self) -> bool:
        """A stop was received and its grace still runs."""
        return self._stops_ns != FAR_FUTURE_NS

    @property
    def may_arm(self) -> bool:
        """Whether `IsArmed` 1 is obeyed."""
        is_silent = self._silent_ns == FAR_FUTURE_NS
        return not (is_silent or self.is_stop_pending)

    @property
    def may_float(self) -> bool:
        """Whether FloatAir on is obeyed."""
        return self.may_arm and not self.is_stopped

    def must_land(self, now_ns: int, *, is_up: bool) -> bool:
        """Whether the node lands now; `is_up` states whether its air is on or it is armed."""
        if self.next_ns > now_ns:
            return False
        if self._silent_ns <= now_ns:
            self._silent_ns = FAR_FUTURE_NS
            self.is_landed_by_silence = is_up
        if self._stops_ns <= now_ns:
            self._stops_ns = FAR_FUTURE_NS
            self.is_stopped = True
        return True

    def stop(self, now_ns: int, grace_s: float) -> None:
        """A stop frame: it may shorten what is left of a grace, never lengthen it."""
        if not self.is_stopped:
            self._stops_ns = min(self._stops_ns, now_ns + round(grace_s * NS_PER_S))

    def command(self, now_ns: int, counter: int) -> None:
        """A command, obeyed or not; one with the counter of the last is silence."""
        if counter != self._received_counter:
            self._received_counter = counter
            self._silent_ns = now_ns + _LANDS_NS

    def arm(self) -> None:
        """An Arm frame of either kind was obeyed."""
        self.is_stopped = self.is_landed_by_silence = False

    def float_on(self) -> None:
        """FloatAir on was obeyed."""
        self.is_landed_by_silence = False
