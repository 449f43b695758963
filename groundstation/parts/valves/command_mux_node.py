"""Command multiplexer: who may command the valves, by the law that the supervisor rules."""

from collections.abc import Iterator

from groundstation.control.brake import BrakeConfig, brake_wrench, dead_reckoned
from groundstation.control.modulation import PulseModulator
from groundstation.control.mux import CommandMux, MuxConfig, Selection, Source
from groundstation.control.state import NO_WRENCH, BodyWrench, ControlState
from groundstation.control.vehicle import VehicleModel
from groundstation.control.wrench_envelope import WrenchEnvelope
from groundstation.declarations.lease import Lease, LeaseCheck
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.declarations.request import Ack, ArgumentError, Request, answer
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.supervision.messages import Supervision
from groundstation.parts.valves.actions import PUSH
from groundstation.parts.valves.messages import ValveDemand, ValveSelection
from groundstation.supervision.modes import Law

PERIOD_NS = 20_000_000
CLOSED = bytes(8)
RULING_NS = 500_000_000
"""A ruling older than this is none: the supervisor is silent."""


class CommandMuxNode(Node):
    """Publishes every 20 ms, and at once on a new demand, what the valves are to do and who wants it.

    Args:
        vehicle: Its name.
        config: How long each source stays fresh.
        brake: The brake law.
        model: Mass properties and valves.
        modulators: Two, for braking and for pushing by hand, apart from that of the controller.
    """

    inputs = (ValveDemand, VehicleState, Supervision, Request, Lease)
    paced = (VehicleState,)
    outputs = (ValveSelection, Ack)
    trigger = ValveDemand

    def __init__(
        self,
        vehicle: str,
        config: MuxConfig,
        brake: BrakeConfig,
        model: VehicleModel,
        modulators: tuple[PulseModulator, PulseModulator],
    ) -> None:
        super().__init__(vehicle, PERIOD_NS)
        self._choice: CommandMux[bytes] = CommandMux(config)
        self._brake = brake
        self._model = model
        self._envelope = WrenchEnvelope(model)
        self._modulator, self._hand = modulators
        self._period_ns = round(self._modulator.config.period_s * 1e9)
        self._brake_due_ns = 0
        self._ruling: Supervision | None = None
        self._ruling_ns = 0
        self._lease = LeaseCheck()
        self._push: BodyWrench | None = None
        self._push_until_ns = self._push_due_ns = 0
        self._state: ControlState | None = None
        self._state_ns = 0
        self._braked_with = NO_WRENCH
        self._counter = self._pulse_id = 0
        self._on_time_ms = CLOSED
        self._source: Source | None = None

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        match message:
            case ValveDemand():
                self._choice.control(message.on_time_ms, now_ns)
                yield self._select(now_ns)
            case VehicleState(status="flying"):
                self._state = ControlState(
                    message.position_table_m,
                    message.velocity_table_m_s,
                    message.heading_rad,
                    message.rate_rad_s,
                )
                self._state_ns = now_ns
                self._choice.receive_state(now_ns)
            case Supervision():
                yield from self._obey(message, now_ns)
            case Lease():
                self._lease.take(message)
            case Request(action="resume") if not self._lease.objection(message, now_ns):
                self._push = None
            case Request() if message.action == PUSH.name:
                yield answer(message, now_ns, self._begin_push(message, now_ns))

    def tick(self, now_ns: int) -> Iterator[Message]:
        if self._push is not None:
            self._pushing(self._push, now_ns)
        yield self._select(now_ns)

    def _obey(self, ruling: Supervision, now_ns: int) -> Iterator[Message]:
        before, self._ruling, self._ruling_ns = self._ruling, ruling, now_ns
        if before is None or before.law != ruling.law:
            self._push = None
            self._choice.forget()
            yield self._select(now_ns)

    def _begin_push(self, request: Request, now_ns: int) -> str:
        """Push by hand from now on; the reason if it cannot be done."""
        refusal = self._lease.objection(request, now_ns)
        if refusal:
            return refusal
        try:
            given = PUSH.read(request)
        except ArgumentError as error:
            return str(error)
        if self._ruling is None or self._ruling.law != Law.CONTROLLER:
            mode = "waiting for its supervisor" if self._ruling is None else self._ruling.mode
            return f"only a flying vehicle can be pushed, it is {mode}"
        self._push = BodyWrench(
            (float(given["force_x_n"]), float(given["force_y_n"])), float(given["torque_nm"])
        )
        self._push_until_ns, self._push_due_ns = now_ns + round(float(given["span_s"]) * 1e9), now_ns
        self._hand.reset()
        return ""

    def _pushing(self, push: BodyWrench, now_ns: int) -> None:
        """Keep the operator's demand fresh, a new pulse each period, until the push has lasted."""
        if now_ns >= self._push_until_ns:
            self._push = None
            self._choice.operate(CLOSED, now_ns)
        elif now_ns >= self._push_due_ns:
            self._choice.operate(bytes(self._hand.update(push).on_time_ms), now_ns)
            self._push_due_ns += self._period_ns

    def _choose(self, now_ns: int) -> Selection[bytes]:
        ruling = self._ruling
        if ruling is None or now_ns - self._ruling_ns > RULING_NS:
            return Selection(Source.CLOSED, None, False, "nothing comes from the supervisor")
        match ruling.law:
            case Law.CONTROLLER:
                return self._choice.select(now_ns)
            case Law.BRAKE:
                return self._choice.brake(now_ns, f"{ruling.mode}: {ruling.cause}")
        return Selection(Source.CLOSED, None, False, f"{ruling.mode}: {ruling.cause}")

    def _select(self, now_ns: int) -> ValveSelection:
        selection = self._choose(now_ns)
        changed = selection.source is not self._source
        self._source = selection.source
        if selection.source is Source.BRAKE:
            self._braking(now_ns, changed=changed)
        elif selection.demand is None:
            if changed:
                self._pulse(CLOSED)
        elif selection.is_new or changed:
            self._pulse(selection.demand)
        return self._say(selection, now_ns)

    def _braking(self, now_ns: int, *, changed: bool) -> None:
        if changed:
            self._modulator.reset()
            self._brake_due_ns = now_ns
            self._braked_with = NO_WRENCH
        if now_ns < self._brake_due_ns or self._state is None:
            return
        wrench = brake_wrench(self._carried(self._state, now_ns), self._brake, self._model, self._envelope)
        pulses = self._modulator.update(wrench)
        self._braked_with = pulses.delivered
        self._pulse(bytes(pulses.on_time_ms))
        self._brake_due_ns += self._period_ns

    def _carried(self, state: ControlState, now_ns: int) -> ControlState:
        """The newest state; where none came for longer than a period, what the pulses have made of it."""
        if now_ns - self._state_ns <= self._period_ns:
            return state
        period_s = self._period_ns * 1e-9
        self._state = dead_reckoned(state, self._braked_with, period_s, self._model)
        return self._state

    def _pulse(self, on_time_ms: bytes) -> None:
        self._on_time_ms = on_time_ms
        self._pulse_id = (self._pulse_id + 1) % 16

    def _say(self, selection: Selection[bytes], now_ns: int) -> ValveSelection:
        self._counter = (self._counter + 1) % 16
        return ValveSelection(
            now_ns,
            self.vehicle,
            self._counter,
            self._pulse_id,
            self._on_time_ms,
            selection.source.value,
            selection.reason,
        )
