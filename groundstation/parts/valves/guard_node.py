"""Guard: the shell around the one gate before the valves (``drivers.valve_bus.guard``)."""

from collections.abc import Iterator, Mapping
from dataclasses import fields

from drivers.valve_bus import messages as bus
from drivers.valve_bus.guard import Guard
from drivers.valve_bus.guard_account import Verdict
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.declarations.request import Ack, ArgumentError, Request, answer
from groundstation.parts.operation.messages import Diagnostics
from groundstation.parts.valves.actions import GUARD
from groundstation.parts.valves.messages import NO_STOP, ValveCommand, ValveSelection, VehicleMode

PERIOD_NS = 20_000_000
DIAGNOSTICS_EVERY = 50


class GuardNode(Node):
    """Lets commands through while the vehicle is armed and the selection is fresh; closes otherwise.

    Args:
        vehicle: Its name.
        guard: The gate before its valves.
        known: Names of all actions; it refuses what none of them is.
        absent: Those of them that no node answers here, and why; it refuses these, too.
    """

    inputs = (ValveSelection, Request)
    outputs = (ValveCommand, VehicleMode, Ack, Diagnostics)
    trigger = ValveSelection

    def __init__(self, vehicle: str, guard: Guard, known: frozenset[str], absent: Mapping[str, str]) -> None:
        super().__init__(vehicle, PERIOD_NS)
        self._guard = guard
        self._known = known
        self._absent = absent
        self._ticks = 0

    def start(self, now_ns: int) -> Iterator[Message]:
        yield self._mode(now_ns, "", "the guard starts disarmed")

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        match message:
            case ValveSelection():
                command = bus.ValveCommand(
                    self._guard.vehicle, message.counter, message.pulse_id, tuple(message.on_time_ms)
                )
                if self._guard.update(now_ns, command) is Verdict.NEW_PULSE:
                    yield self._output(now_ns)
            case Request() if self._answers(message.action):
                reason = self._carry_out(message, now_ns)
                yield answer(message, now_ns, reason)
                if not reason:
                    yield self._mode(now_ns, message.author, message.action)
                    yield self._output(now_ns)

    def tick(self, now_ns: int) -> Iterator[Message]:
        yield self._output(now_ns)
        self._ticks += 1
        if self._ticks % DIAGNOSTICS_EVERY == 0:
            counters = self._guard.counters
            names = tuple(field.name for field in fields(counters))
            values = tuple(str(getattr(counters, name)) for name in names)
            yield Diagnostics(now_ns, self.vehicle, f"{self.vehicle}/guard", 0, "", names, values)

    def stop(self, now_ns: int) -> Iterator[Message]:
        self._guard.stop(now_ns, bus.StopReason.SHUTDOWN)
        yield self._output(now_ns)

    def _answers(self, action: str) -> bool:
        return action in GUARD or action in self._absent or action not in self._known

    def _carry_out(self, request: Request, now_ns: int) -> str:
        """Do what was asked; the reason if it cannot be done."""
        if request.action in self._absent:
            return self._absent[request.action]
        if request.action not in GUARD:
            return f"unknown action '{request.action}' (known: {', '.join(sorted(self._known))})"
        try:
            GUARD[request.action].read(request)
        except ArgumentError as error:
            return str(error)
        match request.action:
            case "arm":
                if not self._guard.arm(now_ns):
                    return "a stop is latched: release it first"
            case "disarm":
                self._guard.disarm(now_ns)
            case "stop":
                self._guard.stop(now_ns, bus.StopReason.OPERATOR)
            case "release":
                self._guard.release_stop(now_ns)
        return ""

    def _mode(self, now_ns: int, author: str, reason: str) -> VehicleMode:
        stopped = self._guard.stop_reason is not None
        return VehicleMode(now_ns, self.vehicle, self._guard.is_armed, stopped, author, reason)

    def _output(self, now_ns: int) -> ValveCommand:
        output = self._guard.tick(now_ns)
        arming = next((message for message in output.messages if isinstance(message, bus.Arm)), None)
        stop = self._guard.stop_reason
        return ValveCommand(
            now_ns,
            self.vehicle,
            output.command.counter,
            output.command.pulse_id,
            bytes(output.command.on_times_ms),
            output.gate.value,
            output.open_mask,
            NO_STOP if stop is None else int(stop),
            0 if arming is None else 1 + arming.is_armed,
        )
