"""The one gate before the valves of a vehicle: closed unless armed, fresh and within limits.

Whatever wants thrust speaks to the guard, and only what `tick` returns goes to the bus. Pure: time is an
argument. The guard repeats the remaining on-time in every frame of a pulse, so that a node which missed
the pulse's first frame opens late and still closes on time.
"""

from dataclasses import replace

from drivers.valve_bus.guard_account import Gate, GuardCounters, GuardOutput, Verdict
from drivers.valve_bus.messages import (
    COUNTER_MODULUS,
    MAX_GRACE_S,
    MAX_ON_TIME_MS,
    SILENCE_CLOSES_S,
    VALVES,
    Arm,
    Stop,
    StopReason,
    ValveBusMessage,
    ValveCommand,
)
from drivers.valve_bus.valve_budget import Clip, OpenTimeLimits, ValveBudget

__all__ = ["Gate", "Guard", "GuardCounters", "GuardOutput", "OpenTimeLimits", "Verdict"]

_NS_PER_S = 1_000_000_000
_SILENCE_NS = round(SILENCE_CLOSES_S * _NS_PER_S)


class Guard:
    """Guards the valves of one vehicle; starts disarmed."""

    def __init__(self, vehicle: int, limits: OpenTimeLimits) -> None:
        self.vehicle = vehicle
        self._counters = GuardCounters()
        self._budgets = [ValveBudget(limits) for _ in range(VALVES)]
        self._is_armed = False
        self._stop_reason: StopReason | None = None
        self._stops_ns: int | None = None  # when the grace of an announced stop is over, guard's own time
        self._last_stamp_ns: int | None = None
        self._offset_ns = 0  # from stamps to the guard's own time, which never goes back
        self._received_ns: int | None = None  # last command in sequence, the first after silence included
        self._is_in_sequence = False
        self._last_counter: int | None = None
        self._last_pulse_id = 0
        self._pending: tuple[int, ...] | None = None
        self._announcement: Arm | None = None
        self._sent_counter = 0
        self._sent_pulse_id = 0

    @property
    def is_armed(self) -> bool:
        """Armed, though a stale command stream may still keep the valves closed."""
        return self._is_armed

    @property
    def stop_reason(self) -> StopReason | None:
        """The latched stop; None when there is none."""
        return self._stop_reason

    @property
    def is_stop_announced(self) -> bool:
        """Commands still pass, but a stop follows when its grace is over."""
        return self._stops_ns is not None

    @property
    def counters(self) -> GuardCounters:
        """A copy of the counters."""
        return replace(self._counters)

    def arm(self, stamp_ns: int) -> bool:
        """Let valves open from the next new pulse on; False (and no change) while a stop holds.

        A node refuses to be armed while a stop is latched or announced, so the guard does.
        """
        self._advance(stamp_ns)
        if self._stop_reason is not None or self._stops_ns is not None:
            return False
        self._is_armed = True
        self._pending = None  # asked for before anybody reported that valves may open
        self._announcement = Arm(self.vehicle, is_armed=True)
        return True

    def disarm(self, stamp_ns: int) -> None:
        """Close all valves from the next tick on."""
        self._advance(stamp_ns)
        self._is_armed = False
        self._announcement = Arm(self.vehicle, is_armed=False)

    def stop(self, stamp_ns: int, reason: StopReason) -> None:
        """Close, disarm and stay so until `release_stop`; every tick repeats the stop frame."""
        self._advance(stamp_ns)
        self._latch_stop(reason)

    def announce_stop(self, stamp_ns: int, grace_s: float) -> None:
        """Let commands pass for `grace_s` more, for braking, then stop as `stop` does.

        Every tick meanwhile begins with the stop frame and the grace that is left, so that the node stops in
        time whatever becomes of the station. A later announcement may shorten the grace, never lengthen it.

        Args:
            stamp_ns: Now.
            grace_s: At most 25.5 s, more is taken for that. Not above 0 (or no number): stop at once, since a
                stop is never refused.
        """
        now_ns = self._advance(stamp_ns)
        if self._stop_reason is not None:
            return
        if not grace_s > 0.0:
            self._latch_stop(StopReason.OPERATOR)
            return
        stops_ns = now_ns + round(min(grace_s, MAX_GRACE_S) * _NS_PER_S)
        self._stops_ns = stops_ns if self._stops_ns is None else min(self._stops_ns, stops_ns)

    def release_stop(self, stamp_ns: int) -> None:
        """Forget a stop, latched or announced; the guard is disarmed.

        A node cannot be told to forget an announced stop: it lands when the grace is over.
        """
        self._advance(stamp_ns)
        if self._stops_ns is not None:
            self._stops_ns = None
            self._is_armed = False
            self._announcement = Arm(self.vehicle, is_armed=False)
        self._stop_reason = None

    def update(self, stamp_ns: int, command: ValveCommand) -> Verdict:
        """Judge a command that arrived at `stamp_ns`. On NEW_PULSE a tick may follow at once."""
        self._counters.commands += 1
        now_ns = self._advance(stamp_ns)
        verdict = self._judge(now_ns, command)
        match verdict:
            case Verdict.NEW_PULSE:
                self._counters.superseded_pulses += self._pending is not None
                self._counters.new_pulses += 1
                self._pending = command.on_times_ms if self._is_armed else None
            case Verdict.FIRST_AFTER_SILENCE:
                self._counters.first_after_silence += 1
                self._pending = None
                self._close_all(now_ns, Gate.STALE)
            case Verdict.REPEATED_COUNTER:
                self._counters.repeated_counter += 1
            case Verdict.COUNTER_BACKWARDS:
                self._counters.counter_backwards += 1
            case Verdict.MALFORMED:
                self._counters.malformed += 1
            case Verdict.OTHER_VEHICLE:
                self._counters.other_vehicle += 1
        return verdict

    def tick(self, stamp_ns: int) -> GuardOutput:
        """What goes to the bus now: due every 20 ms, welcome at once after a new pulse."""
        now_ns = self._advance(stamp_ns)
        gate = self._gate(now_ns)
        if gate is not Gate.OPEN:
            self._close_all(now_ns, gate)
        elif self._pending is not None:
            self._start_pulse(now_ns, self._pending)
        self._pending = None
        remaining_ms = tuple([budget.remaining_ms(now_ns) for budget in self._budgets])
        command = ValveCommand(self.vehicle, self._sent_counter, self._sent_pulse_id, remaining_ms)
        self._sent_counter = (self._sent_counter + 1) % COUNTER_MODULUS
        messages: list[ValveBusMessage] = []
        if self._stop_reason is not None:
            messages.append(Stop(self.vehicle, self._stop_reason))
        elif self._stops_ns is not None:
            messages.append(Stop(self.vehicle, StopReason.OPERATOR, (self._stops_ns - now_ns) / _NS_PER_S))
        if self._announcement is not None:
            messages.append(self._announcement)
            self._announcement = None
        messages.append(command)
        open_mask = 0
        for valve, budget in enumerate(self._budgets):
            if budget.is_open(now_ns):
                open_mask |= 1 << valve
        return GuardOutput(tuple(messages), command, gate, open_mask)

    def _advance(self, stamp_ns: int) -> int:
        """The guard's own time. A clock that goes back would make old commands look fresh: stop.

        An announced stop whose grace is over becomes a latched one.
        """
        if self._last_stamp_ns is not None and stamp_ns < self._last_stamp_ns:
            self._counters.clock_went_back += 1
            self._offset_ns += self._last_stamp_ns - stamp_ns
            self._received_ns = None
            self._latch_stop(StopReason.GUARD)
        self._last_stamp_ns = stamp_ns
        now_ns = stamp_ns + self._offset_ns
        if self._stops_ns is not None and now_ns >= self._stops_ns:
            self._latch_stop(StopReason.OPERATOR)
        return now_ns

    def _judge(self, now_ns: int, command: ValveCommand) -> Verdict:
        if command.vehicle != self.vehicle:
            return Verdict.OTHER_VEHICLE
        if not _is_well_formed(command):
            return Verdict.MALFORMED
        was_silent = self._is_silent(now_ns)
        step = 1 if self._last_counter is None else (command.counter - self._last_counter) % COUNTER_MODULUS
        if step == 0:
            return Verdict.REPEATED_COUNTER
        if not was_silent and step > COUNTER_MODULUS // 2:
            return Verdict.COUNTER_BACKWARDS
        is_new_pulse = command.pulse_id != self._last_pulse_id
        self._received_ns = now_ns
        self._last_counter = command.counter
        self._last_pulse_id = command.pulse_id
        self._is_in_sequence = not was_silent
        if was_silent:
            return Verdict.FIRST_AFTER_SILENCE
        self._counters.lost_commands += step - 1
        return Verdict.NEW_PULSE if is_new_pulse else Verdict.REFRESHED

    def _is_silent(self, now_ns: int) -> bool:
        return self._received_ns is None or now_ns - self._received_ns >= _SILENCE_NS

    def _gate(self, now_ns: int) -> Gate:
        if self._stop_reason is not None:
            return Gate.STOPPED
        if not self._is_armed:
            return Gate.DISARMED
        if self._is_silent(now_ns) or not self._is_in_sequence:
            return Gate.STALE
        return Gate.OPEN

    def _latch_stop(self, reason: StopReason) -> None:
        if self._stop_reason is None:
            self._counters.stops += 1
            self._stop_reason = reason
        self._is_armed = False
        self._stops_ns = None
        self._announcement = None  # the stop frame states more

    def _start_pulse(self, now_ns: int, on_times_ms: tuple[int, ...]) -> None:
        self._sent_pulse_id = (self._sent_pulse_id + 1) % COUNTER_MODULUS
        for budget, on_time_ms in zip(self._budgets, on_times_ms, strict=True):
            _, clip = budget.grant(now_ns, on_time_ms)
            self._counters.clipped_by_run += clip is Clip.RUN
            self._counters.clipped_by_duty += clip is Clip.DUTY

    def _close_all(self, now_ns: int, gate: Gate) -> None:
        were_open = [budget.cut(now_ns) for budget in self._budgets]
        if any(were_open):
            self._sent_pulse_id = (self._sent_pulse_id + 1) % COUNTER_MODULUS
            self._counters.stale_cuts += gate is Gate.STALE


def _is_well_formed(command: ValveCommand) -> bool:
    return (
        0 <= command.counter < COUNTER_MODULUS
        and 0 <= command.pulse_id < COUNTER_MODULUS
        and len(command.on_times_ms) == VALVES
        and all(isinstance(ms, int) and 0 <= ms <= MAX_ON_TIME_MS for ms in command.on_times_ms)
    )
