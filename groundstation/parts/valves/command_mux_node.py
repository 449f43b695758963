"""Command multiplexer: who may command the valves. Stop and brake > operator > controller."""

from collections.abc import Iterator

from groundstation.control.brake import BrakeConfig, brake_wrench
from groundstation.control.edge import EdgeVerdict, edge_outlook
from groundstation.control.keep_in import KeepIn
from groundstation.control.modulation import PulseModulator
from groundstation.control.mux import CommandMux, MuxConfig, Selection, Source
from groundstation.control.state import BodyWrench, ControlState
from groundstation.control.vehicle import VehicleModel
from groundstation.control.wrench_envelope import WrenchEnvelope
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.declarations.request import Ack, ArgumentError, Request, answer
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.valves.actions import MULTIPLEXER
from groundstation.parts.valves.messages import ValveDemand, ValveSelection

PERIOD_NS = 20_000_000
CLOSED = bytes(8)
RELIED_ON = 0.9  # of the nominal thrust: spread and sag of the valves
SLOPE_M_S2 = 0.005  # a table half a milliradian off level
REACTION_S = 0.15  # age of the state, a modulation period, the opening of a valve


class CommandMuxNode(Node):
    """Publishes every 20 ms, and at once on a new demand, what the valves are to do and who wants it.

    Args:
        vehicle: Its name.
        config: How long each source stays fresh.
        brake: The brake law.
        model: Mass properties and valves.
        modulators: Two, for braking and for pushing by hand, apart from that of the controller.
        keep_in: Region of the table; a vehicle that would not stop inside is braked.
    """

    inputs = (ValveDemand, VehicleState, Request)
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
        keep_in: KeepIn,
    ) -> None:
        super().__init__(vehicle, PERIOD_NS)
        self._keep_in = keep_in
        self._choice: CommandMux[bytes] = CommandMux(config)
        self._brake = brake
        self._model = model
        self._envelope = WrenchEnvelope(model)
        self._modulator, self._hand = modulators
        self._period_ns = round(self._modulator.config.period_s * 1e9)
        self._brake_due_ns = 0
        self._brake_asked = False
        self._push: BodyWrench | None = None
        self._push_until_ns = self._push_due_ns = 0
        self._state: ControlState | None = None
        self._braking_m_s2 = RELIED_ON * self._envelope.max_force_n / model.mass_kg - SLOPE_M_S2
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
                self._choice.receive_state(now_ns)
            case Request(action="stop"):
                self._choice.stop(f"asked for by {message.author}")
                yield self._select(now_ns)
            case Request(action="release"):
                self._choice.release_stop()
            case Request() if message.action in MULTIPLEXER:
                yield answer(message, now_ns, self._carry_out(message, now_ns))

    def tick(self, now_ns: int) -> Iterator[Message]:
        if self._brake_asked:
            self._choice.brake(now_ns, "asked for by request")
        elif self._is_leaving():
            self._choice.brake(now_ns, "it would not stop before the edge of the table")
        if self._push is not None:
            self._pushing(self._push, now_ns)
        yield self._select(now_ns)

    def _carry_out(self, request: Request, now_ns: int) -> str:
        """Do what was asked; the reason if it cannot be done."""
        try:
            given = MULTIPLEXER[request.action].read(request)
        except ArgumentError as error:
            return str(error)
        if request.action == "push":
            self._push = BodyWrench(
                (float(given["force_x_n"]), float(given["force_y_n"])), float(given["torque_nm"])
            )
            self._push_until_ns, self._push_due_ns = now_ns + round(float(given["span_s"]) * 1e9), now_ns
            self._hand.reset()
            return ""
        self._brake_asked = request.action == "brake"
        self._push = None
        return ""

    def _pushing(self, push: BodyWrench, now_ns: int) -> None:
        """Keep the operator's demand fresh, a new pulse each period, until the push has lasted."""
        if now_ns >= self._push_until_ns:
            self._push = None
            self._choice.operate(CLOSED, now_ns)
        elif now_ns >= self._push_due_ns:
            self._choice.operate(bytes(self._hand.update(push).on_time_ms), now_ns)
            self._push_due_ns += self._period_ns

    def _is_leaving(self) -> bool:
        if self._state is None:
            return False
        outlook = edge_outlook(self._state, self._keep_in, self._braking_m_s2, reaction_s=REACTION_S)
        return outlook.verdict is not EdgeVerdict.CLEAR

    def _select(self, now_ns: int) -> ValveSelection:
        selection = self._choice.select(now_ns)
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
        if now_ns >= self._brake_due_ns and self._state is not None:
            wrench = brake_wrench(self._state, self._brake, self._model, self._envelope)
            self._pulse(bytes(self._modulator.update(wrench).on_time_ms))
            self._brake_due_ns += self._period_ns

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
