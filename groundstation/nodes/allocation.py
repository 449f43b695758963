"""Allocation: a wrench in, valve on-times for the next modulation period out."""

from collections.abc import Iterator

from groundstation.control.modulation import PulseModulator
from groundstation.control.state import Wrench as BodyWrench
from groundstation.messages.base import Message
from groundstation.messages.definitions import ValveDemand, Wrench
from groundstation.nodes.node import Node


class Allocation(Node):
    """Turns each wrench of the controller into pulses; the controller's rate is the modulation's."""

    inputs = (Wrench,)
    outputs = (ValveDemand,)

    def __init__(self, vehicle: str, modulator: PulseModulator) -> None:
        super().__init__(vehicle)
        self._modulator = modulator

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
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
