"""Command multiplexer: chooses who commands, filters for safety, allocates to the valves."""

from collections.abc import Iterator

from groundstation.control.braking import Braking
from groundstation.control.modulation import PulseModulator
from groundstation.control.mux import CommandMux, Selection, Source
from groundstation.control.state import NO_WRENCH, BodyWrench, ControlState
from groundstation.control.valve_health import health_of
from groundstation.declarations.lease import Lease, LeaseCheck
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.declarations.request import Ack, Request, answer
from groundstation.parts.control.messages import Wrench
from groundstation.parts.fusion.messages import VehicleState, control_state
from groundstation.parts.outside.messages import OutsideWrench
from groundstation.parts.supervision.messages import Supervision, ValveShares
from groundstation.parts.valves.actions import PUSH
from groundstation.parts.valves.hand_push import HandPush
from groundstation.parts.valves.messages import Outlook, OutsideControl, ValveDemand, ValveSelection
from groundstation.parts.valves.outside_pilot import OutsidePilot
from groundstation.parts.valves.safe_wish import SafeWish
from groundstation.supervision.modes import Law

PERIOD_NS = 20_000_000
CLOSED = bytes(8)
RULING_NS = 500_000_000
"""A ruling older than this is none: the supervisor is silent."""
OUTLOOK_EVERY = 5
KNOWN_PLACES = frozenset({"flying", "resting", "lost"})
"""Of the states of an estimator: those in which the place that it reports means something."""


class CommandMuxNode(Node):
    """Publishes every 20 ms, and at once on a new wrench, what the valves are to do and who wants it.

    Args:
        vehicle: Its name.
        others: The other vehicles.
        choice: Who may command.
        braking: The brake law.
        safety: What stands behind every source but the brake.
        modulator: Makes pulses.
    """

    inputs = (Wrench, OutsideWrench, VehicleState, Supervision, ValveShares, Request, Lease)
    paced = (VehicleState,)
    outputs = (ValveDemand, ValveSelection, OutsideControl, Outlook, Ack)
    trigger = Wrench

    def __init__(
        self,
        vehicle: str,
        others: tuple[str, ...],
        choice: CommandMux[BodyWrench],
        braking: Braking,
        safety: SafeWish,
        modulator: PulseModulator,
    ) -> None:
        super().__init__(vehicle, PERIOD_NS)
        self._others = others
        self._choice, self._braking, self._safety = choice, braking, safety
        self._modulator = modulator
        self._period_ns = round(modulator.config.period_s * 1e9)
        self._due_ns: int  # since the source changed, from none to closed at first
        self._hand = HandPush(self._period_ns)
        self._outside = OutsidePilot(vehicle, choice, self._period_ns)
        self._ruling: Supervision | None = None
        self._ruling_ns: int  # of the ruling
        self._lease = LeaseCheck()
        self._counter = self._pulse_id = self._ticks = 0
        self._on_time_ms = CLOSED
        self._source: Source | None = None

    def sources(self, payload: type[Message]) -> tuple[str, ...]:
        return (self.vehicle, *self._others) if payload is VehicleState else (self.vehicle,)

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        match message:
            case Wrench():
                wrench = BodyWrench((message.force_x_n, message.force_y_n), message.torque_z_nm)
                self._choice.control(wrench, now_ns)
                yield from self._select(now_ns)
            case OutsideWrench():
                objection = self._lease.objection_to_commands(message.author, now_ns)
                yield from self._outside.take(message, objection, self._law(now_ns), now_ns)
                if self._outside.offer(self._law(now_ns), now_ns):
                    yield from self._select(now_ns)
            case VehicleState():
                self._see(message, now_ns)
            case Supervision():
                yield from self._obey(message, now_ns)
            case ValveShares():
                self._modulator.take_health(health_of(message.open_ratio, message.shut_ratio))
                self._braking.envelope = self._modulator.envelope
            case Lease():
                self._lease.take(message)
                self._outside.follow_lease(message.holder)
            case Request(action="resume") if not self._lease.objection(message, now_ns):
                self._hand.end()
                self._outside.give_back(f"resumed by {message.author}", now_ns)
            case Request() if message.action == PUSH.name:
                refusal = self._lease.objection(message, now_ns)
                refusal = refusal or self._hand.begin(message, self._ruling, now_ns)
                if not refusal:
                    self._modulator.reset()
                yield answer(message, now_ns, refusal)

    def tick(self, now_ns: int) -> Iterator[Message]:
        push, is_over = self._hand.due(now_ns)
        if push is not None or is_over:
            self._choice.operate(push or NO_WRENCH, now_ns)
        self._outside.offer(self._law(now_ns), now_ns)
        yield from self._select(now_ns)
        yield from self._outside.report(now_ns)
        self._ticks += 1
        if self._ticks % OUTLOOK_EVERY == 0 and self._braking.state is not None:
            yield self._look_ahead(self._braking.state, now_ns)

    def _see(self, message: VehicleState, now_ns: int) -> None:
        if message.status not in KNOWN_PLACES:
            return
        state = control_state(message)
        is_flown = message.status == "flying"
        sigma_m = message.pose_sigma[:2]
        if message.vehicle != self.vehicle:
            self._safety.surroundings.see(message.vehicle, state, sigma_m, now_ns, is_flown=is_flown)
        elif is_flown:
            self._safety.own_sigma_m = sigma_m
            self._braking.take(state, now_ns)
            self._choice.receive_state(now_ns)

    def _obey(self, ruling: Supervision, now_ns: int) -> Iterator[Message]:
        before, self._ruling, self._ruling_ns = self._ruling, ruling, now_ns
        if before is None or before.law != ruling.law:
            self._hand.end()
            self._choice.forget()
            self._outside.follow_law(self._law(now_ns), now_ns)
            yield from self._select(now_ns)

    def _law(self, now_ns: int) -> Law | None:
        """What the supervisor rules; None where nothing comes from it."""
        ruling = self._ruling
        return None if ruling is None or now_ns - self._ruling_ns > RULING_NS else Law(ruling.law)

    def _choose(self, now_ns: int) -> Selection[BodyWrench]:
        ruling, law = self._ruling, self._law(now_ns)
        if ruling is None or law is None:
            return Selection(Source.CLOSED, None, False, "nothing comes from the supervisor")
        match law:
            case Law.CONTROLLER:
                return self._choice.select(now_ns)
            case Law.BRAKE:
                return self._choice.brake(now_ns, f"{ruling.mode}: {ruling.cause}")
        return Selection(Source.CLOSED, None, False, f"{ruling.mode}: {ruling.cause}")

    def _select(self, now_ns: int) -> Iterator[Message]:
        selection = self._choose(now_ns)
        changed = selection.source is not self._source
        self._source = selection.source
        if changed:  # what another source was owed is of no use to this one
            self._modulator.reset()
            self._due_ns = now_ns
            self._safety.limited_by = ""
            self._braking.begin()
        if selection.source is Source.CLOSED:
            if changed:
                self._pulse(CLOSED)
        elif selection.source is Source.BRAKE:
            if now_ns >= self._due_ns:
                self._due_ns += self._period_ns
                yield from self._make(self._braking.wrench(now_ns, self._safety.resting_place), now_ns)
        elif selection.is_new or changed:
            yield from self._make(selection.demand, now_ns)
        self._counter = (self._counter + 1) % 16
        yield ValveSelection(
            now_ns,
            self.vehicle,
            self._counter,
            self._pulse_id,
            self._on_time_ms,
            selection.source.value,
            selection.reason,
        )

    def _make(self, wanted: BodyWrench | None, now_ns: int) -> Iterator[Message]:
        """Pulses for what is wanted, as far as it is safe."""
        if wanted is None:
            return
        is_brake = self._source is Source.BRAKE and self._braking.held is None
        safe = wanted if is_brake else self._safety.filtered(wanted, now_ns)
        pulses = self._modulator.update(safe)
        self._braking.deliver(pulses.delivered)
        self._pulse(bytes(pulses.on_time_ms))
        yield ValveDemand(
            now_ns,
            self.vehicle,
            self._on_time_ms,
            str(self._source),
            wanted.force_body_n,
            wanted.torque_nm,
            self._safety.limited_by,
            pulses.delivered.force_body_n,
            pulses.delivered.torque_nm,
        )

    def _look_ahead(self, state: ControlState, now_ns: int) -> Outlook:
        edge, nearest = self._safety.outlook(state, now_ns)
        return Outlook(
            now_ns,
            self.vehicle,
            edge.time_to_edge_s,
            edge.stopping_distance_m,
            edge.room_m,
            nearest.name,
            nearest.room_m,
            self._safety.limited_by,
        )

    def _pulse(self, on_time_ms: bytes) -> None:
        self._on_time_ms = on_time_ms
        self._pulse_id = (self._pulse_id + 1) % 16
