"""Valve writer: guarded commands in, CAN frames out; frames of the valve node in, its status out."""

import math
from collections.abc import Iterator

from drivers.valve_bus import messages as bus
from drivers.valve_bus.frame import CanFrame
from drivers.valve_bus.protocol import decode, encode, may_concern
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.parts.supervision.messages import StopPress, Supervision
from groundstation.parts.valves.messages import NO_STOP, CanIn, CanOut, ValveCommand, ValveStatus
from groundstation.supervision.seen_faults import COIL_FAULT

FLOAT_RETRY_NS = 100_000_000
COUNTED_NS = 250_000_000
"""Over so long frames are counted."""
BUTTON_PAUSE_NS = 300_000_000
"""Stop frames that follow each other faster are one press."""


BUTTON = "CAN button"
"""Author of stop presses that arrive as frames on the valve bus."""


class ValveWriter(Node):
    """Speaks the valve bus for one vehicle; repeats a float-air order until the node reports it.

    A stop frame that arrives comes from a button on the bus and counts as a press.
    """

    inputs = (ValveCommand, CanIn, Supervision)
    outputs = (CanOut, ValveStatus, StopPress)

    def __init__(self, vehicle: str, bus_index: int) -> None:
        super().__init__(vehicle, FLOAT_RETRY_NS)
        self._index = bus_index
        self._wanted_float: bool | None = None
        self._float_counter = self._presses = 0
        self._stop_frame_ns = -BUTTON_PAUSE_NS
        self._frames, self._counted_ns, self._bus_rate_hz = 0, 0, 0.0
        self._floating: bool | None = None
        self._pressure_pa = math.nan

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        match message:
            case ValveCommand():
                yield from self._command(message, now_ns)
            case CanIn():
                yield from self._received(message, now_ns)
            case Supervision():
                was_wanted, self._wanted_float = self._wanted_float, message.air_on
                if message.air_on is not was_wanted:
                    yield self._float_order(now_ns)

    def tick(self, now_ns: int) -> Iterator[Message]:
        if self._wanted_float is not None and self._wanted_float is not self._floating:
            yield self._float_order(now_ns)

    def _command(self, message: ValveCommand, now_ns: int) -> Iterator[Message]:
        if message.stop_reason != NO_STOP:
            reason = bus.StopReason(message.stop_reason)
            yield self._frame(bus.Stop(self._index, reason, message.stop_grace_s), now_ns)
        if message.arm:
            yield self._frame(bus.Arm(self._index, is_armed=message.arm == 2), now_ns)
        command = bus.ValveCommand(self._index, message.counter, message.pulse_id, tuple(message.on_time_ms))
        yield self._frame(command, now_ns)

    def _received(self, message: CanIn, now_ns: int) -> Iterator[Message]:
        self._frames += message.passed
        if now_ns - self._counted_ns >= COUNTED_NS:
            self._bus_rate_hz = self._frames * 1e9 / (now_ns - self._counted_ns)
            self._frames, self._counted_ns = 0, now_ns
        if not may_concern(message.arbitration_id, self._index):
            return
        reported = decode(CanFrame(message.arbitration_id, message.data))
        match reported:
            case bus.Stop() if reported.vehicle in (self._index, bus.EVERY_VEHICLE):
                pause_ns, self._stop_frame_ns = now_ns - self._stop_frame_ns, now_ns
                if pause_ns >= BUTTON_PAUSE_NS:  # a button repeats its frame while it is held
                    self._presses += 1
                    yield StopPress(now_ns, self.vehicle, self._presses, f"{BUTTON} of {self.vehicle}")
            case bus.TankPressure() if reported.vehicle == self._index:
                self._pressure_pa = reported.tank_pa
            case bus.ValveStatus() if reported.vehicle == self._index:
                self._floating = reported.is_float_air_on
                yield ValveStatus(
                    message.stamp_ns,  # of its arrival: it may have waited
                    self.vehicle,
                    reported.open_mask,
                    reported.executed_counter,
                    reported.is_armed,
                    reported.is_dead_man_closed,
                    reported.is_float_air_on,
                    self._pressure_pa,
                    reported.node_faults | (COIL_FAULT if reported.valve_fault_mask else 0),
                    self._bus_rate_hz,
                )

    def _float_order(self, now_ns: int) -> CanOut:
        self._float_counter = (self._float_counter + 1) % 16
        order = bus.FloatAir(self._index, is_on=bool(self._wanted_float), counter=self._float_counter)
        return self._frame(order, now_ns)

    def _frame(self, reported: bus.ValveBusMessage, now_ns: int) -> CanOut:
        frame = encode(reported)
        return CanOut(now_ns, self.vehicle, frame.arbitration_id, frame.data)
