"""Guard: the shell around the one gate before the valves (``drivers.valve_bus.guard``)."""

from collections.abc import Iterator
from dataclasses import fields

from drivers.valve_bus import messages as bus
from drivers.valve_bus.guard import Guard
from drivers.valve_bus.guard_account import Verdict
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.parts.operation.messages import Diagnostics
from groundstation.parts.supervision.messages import Supervision
from groundstation.parts.valves.messages import NO_STOP, ValveCommand, ValveSelection, ValveStatus

PERIOD_NS = 20_000_000
RULING_NS = 500_000_000
"""A ruling older than this is none: the supervisor is silent."""
ARM_AGAIN_NS = 100_000_000
DIAGNOSTICS_EVERY = 50


class GuardNode(Node):
    """Lets commands through while the supervisor says so and the selection is fresh; closes otherwise.

    Args:
        vehicle: Its name.
        guard: The gate before its valves.
    """

    inputs = (ValveSelection, Supervision, ValveStatus)
    outputs = (ValveCommand, Diagnostics)
    trigger = ValveSelection

    def __init__(self, vehicle: str, guard: Guard) -> None:
        super().__init__(vehicle, PERIOD_NS)
        self._guard = guard
        self._ruling_ns: int | None = None
        self._obeyed: tuple[bool, bool, bool] | None = None
        self._armed_ns = 0
        self._ticks = 0

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        match message:
            case ValveSelection():
                command = bus.ValveCommand(
                    self._guard.vehicle, message.counter, message.pulse_id, tuple(message.on_time_ms)
                )
                if self._guard.update(now_ns, command) is Verdict.NEW_PULSE:
                    yield self._output(now_ns)
            case Supervision():
                self._ruling_ns = now_ns
                if self._obey(message, now_ns):
                    yield self._output(now_ns)
            case ValveStatus(armed=False) if self._guard.is_armed:
                if now_ns - self._armed_ns >= ARM_AGAIN_NS:  # the node missed the order
                    self._arm(now_ns)

    def tick(self, now_ns: int) -> Iterator[Message]:
        if self._guard.is_armed and (self._ruling_ns is None or now_ns - self._ruling_ns > RULING_NS):
            self._guard.disarm(now_ns)
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

    def _obey(self, ruling: Supervision, now_ns: int) -> bool:
        """Take over a ruling; True where it is to reach the bus at once."""
        guard = self._guard
        asked = ruling.may_open, ruling.stop_latched, ruling.grace_s > 0.0
        has_changed, self._obeyed = asked != self._obeyed, asked
        if not ruling.stop_latched:
            if guard.stop_reason is not None or guard.is_stop_announced:
                guard.release_stop(now_ns)
        else:
            guard.announce_stop(now_ns, ruling.grace_s)  # without grace: at once
        if ruling.may_open and not guard.is_armed:
            self._arm(now_ns)
        elif guard.is_armed and not ruling.may_open:
            guard.disarm(now_ns)
        return has_changed

    def _arm(self, now_ns: int) -> None:
        if self._guard.arm(now_ns):
            self._armed_ns = now_ns

    def _output(self, now_ns: int) -> ValveCommand:
        output = self._guard.tick(now_ns)
        arming = next((message for message in output.messages if isinstance(message, bus.Arm)), None)
        stop = next((message for message in output.messages if isinstance(message, bus.Stop)), None)
        return ValveCommand(
            now_ns,
            self.vehicle,
            output.command.counter,
            output.command.pulse_id,
            bytes(output.command.on_times_ms),
            output.gate.value,
            output.open_mask,
            NO_STOP if stop is None else int(stop.reason),
            0.0 if stop is None else stop.grace_s,
            0 if arming is None else 1 + arming.is_armed,
        )
