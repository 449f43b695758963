"""The CAN node of one vehicle: commands to coil currents, and what it reports about itself.

A new pulse id sets every valve's remaining on-time, an unchanged one only refreshes the dead-man. Silence
of 100 ms closes all; silence of 1 s, or a stop whose grace is over, closes all, cuts the float air and
disarms (`docs/interfaces/valve_bus.md`).
"""

from collections import deque
from collections.abc import Callable
from functools import lru_cache

import numpy as np

from drivers.valve_bus.protocol import (
    ARM_KEY,
    EVERY_VEHICLE,
    SILENCE_CLOSES_S,
    Arm,
    CanFrame,
    FloatAir,
    Heartbeat,
    NodeState,
    Stop,
    TankPressure,
    ValveCommand,
    ValveStatus,
    decode,
    encode,
    may_concern,
)
from firmware_emulator.devices.babble import Babble
from firmware_emulator.devices.landing_rules import LandingRules
from firmware_emulator.devices.valve_failures import ValveFailures
from firmware_emulator.failures import Failures
from firmware_emulator.plant.rigid_body import Vehicle
from firmware_emulator.plant.thrusters import FAR_FUTURE_NS, NS_PER_S

STATUS_NS = 20_000_000
SLOW_NS = 200_000_000  # pressure and heartbeat
FIRMWARE = (1, 0)
_SILENCE_NS = round(SILENCE_CLOSES_S * NS_PER_S)
_MS = 1_000_000
_TANK_NOISE_PA = 20e3
_SUPPLY_NOISE_PA = 500.0
_GAS_K = 293.0


class ValveNode:
    """Firmware of the node.

    Args:
        index: Vehicle's index on the bus.
        vehicle: What its valves push.
        minimum_on_ms: A closed valve is not opened for a shorter pulse.
        float_delay_s: From switching the air until the bearings lift or set down.
        failures: Valve and bus failures.
        rng: For sensor noise.
        start_ns: Power-up.
    """

    def __init__(
        self,
        index: int,
        vehicle: Vehicle,
        minimum_on_ms: int,
        float_delay_s: float,
        failures: Failures,
        rng: np.random.Generator,
        start_ns: int = 0,
    ) -> None:
        self._index, self._vehicle = index, vehicle
        self._minimum_on_ms, self._float_delay_s = minimum_on_ms, float_delay_s
        self._failures, self._rng, self._start_ns = failures, rng, start_ns
        self._inbox: deque[tuple[int, CanFrame]] = deque()
        self.outbox: list[CanFrame] = []  # what it sends now
        self.babbled: list[CanFrame] = []  # and what it ought not to
        # Fifty times a second, and nearly always one of the sixteen counters with nothing else new.
        self._encode_status: Callable[[ValveStatus], CanFrame] = lru_cache(256)(encode)
        self._off_ns: dict[int, int] = {}  # energised valves and when their time is up
        self._dead_man_ns = start_ns + _SILENCE_NS  # from power-up, as if a command had been accepted then
        self._landing = LandingRules(start_ns)
        # Nodes do not power up at the same moment: their cycles are spread over the bus.
        self._status_ns = start_ns + STATUS_NS + index * 1_300_000
        self._slow_ns = start_ns + SLOW_NS + index * 1_300_000 + 600_000
        self._ailments = ValveFailures(vehicle, failures, start_ns)
        self._babble = Babble(index, failures, start_ns)
        self._last_status: CanFrame | None = None
        failures.watch("valves", self._notice_failure)
        self._is_armed = self._is_dead_man_closed = False
        self._is_air_on = vehicle.is_floating
        self._last_counter: int | None = None
        self._last_pulse_id: int | None = None
        self._rejected = self._status_counter = 0

    @property
    def next_ns(self) -> int:
        """Moment of the next thing it does."""
        moments = [self.next_output_ns, self._dead_man_ns, self._landing.next_ns, self._ailments.next_ns]
        moments += self._off_ns.values()
        if self._inbox:
            moments.append(self._inbox[0][0])
        return min(moments)

    @property
    def next_output_ns(self) -> int:
        """When it next sends something."""
        return min(self._status_ns, self._slow_ns, self._babble.next_ns)

    def receive(self, stamp_ns: int, frame: CanFrame) -> None:
        """A frame that is complete on the bus at `stamp_ns`; those for others pass its filter by."""
        if may_concern(frame.arbitration_id, self._index):
            self._inbox.append((stamp_ns, frame))

    def run(self, now_ns: int) -> None:
        """Do what is due at `now_ns`: time-outs first, then what was received, then send."""
        self._ailments.run(now_ns)
        for valve in [valve for valve, off_ns in self._off_ns.items() if off_ns <= now_ns]:
            self._close([valve], now_ns)
        if self._dead_man_ns <= now_ns:
            self._dead_man_ns = FAR_FUTURE_NS
            self._is_dead_man_closed = True
            self._close(list(self._off_ns), now_ns)
        self._land_if_due(now_ns)
        is_silent = self._failures.active("silent_bus", now_ns - self._start_ns) is not None
        while self._inbox and self._inbox[0][0] <= now_ns:
            _, frame = self._inbox.popleft()
            if not is_silent:
                self._obey(frame, now_ns)
        self._send_due(now_ns, is_silent)

    def _obey(self, frame: CanFrame, now_ns: int) -> None:
        message = decode(frame)
        match message:
            case ValveCommand(vehicle=self._index):
                self._command(message, now_ns)
            case Stop(vehicle=vehicle) if vehicle in (self._index, EVERY_VEHICLE):
                self._landing.stop(now_ns, message.grace_s)
                self._land_if_due(now_ns)
            case Arm(vehicle=self._index, key=key) if key == ARM_KEY and (
                self._landing.may_arm or not message.is_armed
            ):
                self._arm(message.is_armed, now_ns)
            case FloatAir(vehicle=self._index, is_on=False):
                self._switch_air(now_ns, is_on=False)
            case FloatAir(vehicle=self._index) if self._landing.may_float:
                self._landing.float_on()
                self._switch_air(now_ns, is_on=True)

    def _land_if_due(self, now_ns: int) -> None:
        """Close all valves, cut the float air and disarm, if a stop or the silence of commands wants it."""
        if self._landing.must_land(now_ns, is_up=self._is_armed or self._is_air_on):
            self._close(list(self._off_ns), now_ns)
            self._is_armed = False
            self._switch_air(now_ns, is_on=False)

    def _switch_air(self, now_ns: int, *, is_on: bool) -> None:
        self._vehicle.advance(now_ns)
        self._vehicle.set_air(now_ns, is_on, self._float_delay_s)
        self._is_air_on = is_on

    def _arm(self, is_armed: bool, now_ns: int) -> None:
        if not is_armed:
            self._close(list(self._off_ns), now_ns)
        self._is_armed = is_armed
        self._landing.arm()

    def _command(self, command: ValveCommand, now_ns: int) -> None:
        self._landing.command(now_ns, command.counter)
        if command.counter == self._last_counter:
            self._rejected += 1
            return
        self._last_counter = command.counter
        self._dead_man_ns = now_ns + _SILENCE_NS
        self._is_dead_man_closed = False
        if command.pulse_id == self._last_pulse_id:
            return
        self._last_pulse_id = command.pulse_id
        if not self._is_armed:
            return
        for valve, on_ms in enumerate(command.on_times_ms):
            if valve in self._off_ns:
                self._off_ns[valve] = now_ns + on_ms * _MS
                if on_ms == 0:
                    self._close([valve], now_ns)
            elif on_ms >= max(1, self._minimum_on_ms):
                self._vehicle.advance(now_ns)
                self._vehicle.thrusters.energise(now_ns, valve)
                self._off_ns[valve] = now_ns + on_ms * _MS

    def _close(self, valves: list[int], now_ns: int) -> None:
        if valves:
            self._vehicle.advance(now_ns)
        for valve in valves:
            del self._off_ns[valve]
            self._vehicle.thrusters.release(now_ns, valve)

    def _notice_failure(self, _: int) -> None:
        self._babble.begin(self._status_ns)

    def _send_due(self, now_ns: int, is_silent: bool) -> None:
        if self._status_ns <= now_ns:
            self._status_ns += STATUS_NS
            self._status_counter = (self._status_counter + 1) & 0xF
            if not is_silent:
                self._last_status = self._status()
                self.outbox.append(self._last_status)
        if self._slow_ns <= now_ns:
            self._slow_ns += SLOW_NS
            if not is_silent:
                self.outbox += [encode(message) for message in self._slow_messages(now_ns)]
        frame = self._babble.take(now_ns, self._last_status)
        if frame is not None:
            self.babbled.append(frame)

    def _status(self) -> CanFrame:
        mask = 0
        for valve in self._off_ns:
            mask |= 1 << valve
        return self._encode_status(
            ValveStatus(
                vehicle=self._index,
                open_mask=mask,
                executed_counter=self._last_counter or 0,
                executed_pulse_id=self._last_pulse_id or 0,
                counter=self._status_counter,
                is_armed=self._is_armed,
                is_dead_man_closed=self._is_dead_man_closed,
                is_stopped=self._landing.is_stopped,
                is_float_air_on=self._is_air_on,
                valve_fault_mask=self._ailments.coil_mask,
                node_faults=self._ailments.node_faults,
                rejected_commands=self._rejected & 0xFF,
                is_stop_pending=self._landing.is_stop_pending,
                is_landed_by_silence=self._landing.is_landed_by_silence,
            )
        )

    def _slow_messages(self, now_ns: int) -> tuple[TankPressure, Heartbeat]:
        self._vehicle.advance(now_ns)
        tank_noise, supply_noise = self._rng.standard_normal(2)
        bank = self._vehicle.thrusters
        state = NodeState.STOPPED if self._landing.is_stopped else NodeState.DISARMED
        return (
            TankPressure(
                self._index,
                tank_pa=max(0.0, bank.tank_pa + _TANK_NOISE_PA * float(tank_noise)),
                supply_pa=max(0.0, bank.supply_pa + _SUPPLY_NOISE_PA * float(supply_noise)),
                gas_temperature_k=_GAS_K,
            ),
            Heartbeat(
                self._index,
                uptime_ms=(now_ns - self._start_ns) // _MS & 0xFFFFFFFF,
                state=NodeState.ARMED if self._is_armed else state,
                firmware_version=FIRMWARE,
            ),
        )
