"""Valve writer: guarded commands in, CAN frames out; frames of the valve node in, its status out."""

import math
from collections.abc import Iterator

from drivers.valve_bus import messages as bus
from drivers.valve_bus.frame import CanFrame
from drivers.valve_bus.protocol import decode, encode
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.declarations.request import Ack, ArgumentError, Request, answer
from groundstation.parts.valves.actions import FLOAT_AIR
from groundstation.parts.valves.messages import NO_STOP, CanIn, CanOut, ValveCommand, ValveStatus

FLOAT_RETRY_NS = 100_000_000


class ValveWriter(Node):
    """Speaks the valve bus for one vehicle; repeats a float-air order until the node reports it."""

    inputs = (ValveCommand, CanIn, Request)
    outputs = (CanOut, ValveStatus, Ack)

    def __init__(self, vehicle: str, bus_index: int) -> None:
        super().__init__(vehicle, FLOAT_RETRY_NS)
        self._index = bus_index
        self._wanted_float: bool | None = None
        self._float_counter = 0
        self._floating: bool | None = None
        self._pressure_pa = math.nan

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        match message:
            case ValveCommand():
                yield from self._command(message, now_ns)
            case CanIn():
                yield from self._received(message, now_ns)
            case Request() if message.action in FLOAT_AIR:
                try:
                    FLOAT_AIR[message.action].read(message)
                except ArgumentError as error:
                    yield answer(message, now_ns, str(error))
                    return
                self._wanted_float = message.action == "float_on"
                yield self._float_order(now_ns)
                yield answer(message, now_ns)

    def tick(self, now_ns: int) -> Iterator[Message]:
        if self._wanted_float is not None and self._wanted_float is not self._floating:
            yield self._float_order(now_ns)

    def _command(self, message: ValveCommand, now_ns: int) -> Iterator[Message]:
        if message.stop_reason != NO_STOP:
            yield self._frame(bus.Stop(self._index, bus.StopReason(message.stop_reason)), now_ns)
        if message.arm:
            yield self._frame(bus.Arm(self._index, is_armed=message.arm == 2), now_ns)
        command = bus.ValveCommand(self._index, message.counter, message.pulse_id, tuple(message.on_time_ms))
        yield self._frame(command, now_ns)

    def _received(self, message: CanIn, now_ns: int) -> Iterator[Message]:
        reported = decode(CanFrame(message.arbitration_id, message.data))
        match reported:
            case bus.TankPressure() if reported.vehicle == self._index:
                self._pressure_pa = reported.tank_pa
            case bus.ValveStatus() if reported.vehicle == self._index:
                self._floating = reported.is_float_air_on
                yield ValveStatus(
                    now_ns,
                    self.vehicle,
                    reported.open_mask,
                    reported.executed_counter,
                    reported.is_armed,
                    reported.is_dead_man_closed,
                    reported.is_float_air_on,
                    self._pressure_pa,
                    reported.node_faults,
                )

    def _float_order(self, now_ns: int) -> CanOut:
        self._float_counter = (self._float_counter + 1) % 16
        order = bus.FloatAir(self._index, is_on=bool(self._wanted_float), counter=self._float_counter)
        return self._frame(order, now_ns)

    def _frame(self, reported: bus.ValveBusMessage, now_ns: int) -> CanOut:
        frame = encode(reported)
        return CanOut(now_ns, self.vehicle, frame.arbitration_id, frame.data)
