"""The brake law with its memory: the newest state, and what its pulses have made of it since."""

from groundstation.control.brake import BrakeConfig, brake_wrench, dead_reckoned
from groundstation.control.state import NO_WRENCH, BodyWrench, ControlState
from groundstation.control.vehicle import VehicleModel
from groundstation.control.wrench_envelope import WrenchEnvelope


class Braking:
    """Brakes on the newest state; where none comes for longer than a period, on dead reckoning.

    Args:
        config: The law.
        model: Mass properties.
        envelope: What the valves can make.
        period_ns: Of the modulation.

    Attributes:
        envelope: See above; it changes where valves fail.
        state: The newest state, or what was reckoned from it; None before the first.
    """

    def __init__(
        self, config: BrakeConfig, model: VehicleModel, envelope: WrenchEnvelope, period_ns: int
    ) -> None:
        self._config, self._model, self._period_ns = config, model, period_ns
        self.envelope = envelope
        self.state: ControlState | None = None
        self._state_ns = 0
        self._delivered = NO_WRENCH

    def take(self, state: ControlState, now_ns: int) -> None:
        """Take a state that arrived."""
        self.state, self._state_ns = state, now_ns

    def deliver(self, delivered: BodyWrench) -> None:
        """Note what the pulses of this period are expected to give."""
        self._delivered = delivered

    def wrench(self, now_ns: int) -> BodyWrench | None:
        """What takes speed and turn away in the period that begins now; None where no state ever came."""
        if self.state is None:
            return None
        if now_ns - self._state_ns > self._period_ns:
            self.state = dead_reckoned(self.state, self._delivered, 1e-9 * self._period_ns, self._model)
        return brake_wrench(self.state, self._config, self._model, self.envelope)
