"""Allocation: a wrench in, valve on-times for the next modulation period out."""

from collections.abc import Iterator

from groundstation.control.modulation import PulseModulator
from groundstation.control.state import BodyWrench
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.parts.control.messages import Wrench
from groundstation.parts.valves.messages import ValveCommand, ValveDemand


class AllocationNode(Node):
    """Turns each wrench of the controller into pulses; the controller's rate is the modulation's."""

    inputs = (Wrench, ValveCommand)
    outputs = (ValveDemand,)

    def __init__(self, vehicle: str, modulator: PulseModulator) -> None:
        super().__init__(vehicle)
        self._modulator = modulator
        self._gate_open = False

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        if isinstance(message, ValveCommand):
            self._receive_gate(is_open=message.gate == "open")
            return
        assert isinstance(message, Wrench)
        demand = BodyWrench((message.force_x_n, message.force_y_n), message.torque_z_nm)
        pulses = self._modulator.update(demand)
        yield ValveDemand(
            now_ns,
            self.vehicle,
            bytes(pulses.on_time_ms),
            pulses.delivered.force_body_n,
            pulses.delivered.torque_nm,
        )

    def _receive_gate(self, *, is_open: bool) -> None:
        """What was carried while the valves were closed is of no use when they open."""
        if is_open and not self._gate_open:
            self._modulator.reset()
        self._gate_open = is_open
