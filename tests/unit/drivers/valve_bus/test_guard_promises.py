"""The guard against everything a bad day can bring, judged by a valve node that knows only the wire."""

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from drivers.valve_bus.guard import Gate, Guard, OpenTimeLimits
from drivers.valve_bus.messages import StopReason, ValveCommand
from drivers.valve_bus.protocol import Stop, decode, encode

MS = 1_000_000
LIMITS = OpenTimeLimits(max_open_s=0.25, min_rest_s=0.02, max_duty_ratio=0.4, duty_window_s=1.0)
TIMES = st.sampled_from([0, 1, 10, 20, 50, 100, 127])
LOST = st.sampled_from([False, False, False, True])


class Node:
    """A valve node by the wire format, without its dead-man, so that the guard alone must close."""

    def __init__(self):
        self.pulse_id = None
        self.close_at_ms = [0] * 8
        self.intervals = [[] for _ in range(8)]  # [opened, closes) of each valve

    def hear(self, frame, now_ms):
        message = decode(frame)
        if isinstance(message, Stop):
            self._set((0,) * 8, now_ms)
        elif isinstance(message, ValveCommand) and message.pulse_id != self.pulse_id:
            self.pulse_id = message.pulse_id
            self._set(message.on_times_ms, now_ms)

    def _set(self, times_ms, now_ms):
        for valve, time_ms in enumerate(times_ms):
            intervals = self.intervals[valve]
            if intervals and intervals[-1][1] > now_ms:
                intervals[-1][1] = now_ms
            if time_ms:
                intervals.append([now_ms, now_ms + time_ms])

    def is_open(self, valve, now_ms):
        return bool(self.intervals[valve]) and self.intervals[valve][-1][1] > now_ms


class GuardedValves(RuleBasedStateMachine):
    """Time in whole milliseconds; the station may arm, stop, fall silent, repeat itself, and lose frames."""

    @initialize(is_armed=st.sampled_from([True, True, False]))
    def begin(self, is_armed):
        self.guard = Guard(3, LIMITS)
        self.node = Node()
        self.now_ms = 0
        self.counter = 0
        self.pulse_id = 0
        self.times = (0,) * 8
        self.advanced_at_ms = []  # commands whose counter stepped forward
        self.is_armed = self.is_stopped = False
        self.stops_at_ms = None  # announced
        self._say(0)
        if is_armed:
            self.arm()
        self._tick()

    def _say(self, counter):
        self.guard.update(self.now_ms * MS, ValveCommand(3, counter % 16, self.pulse_id % 16, self.times))

    def _tick(self, is_lost=False):
        if self.stops_at_ms is not None and self.now_ms >= self.stops_at_ms:
            self.is_armed, self.is_stopped, self.stops_at_ms = False, True, None
        self.last = self.guard.tick(self.now_ms * MS)
        for message in self.last.messages:
            if not is_lost:
                self.node.hear(encode(message), self.now_ms)

    @rule(
        times=st.tuples(*[TIMES] * 8),
        wait_ms=st.sampled_from([5, 20, 20, 60, 90, 130]),
        cycles=st.integers(1, 40),
    )
    def pulses(self, times, wait_ms, cycles):
        for _ in range(cycles):
            self.counter += 1
            self.pulse_id += 1
            self.times = times
            self._say(self.counter)
            self.advanced_at_ms.append(self.now_ms)
            self._tick()
            self.now_ms += wait_ms
            self._tick()

    @rule(steps=st.integers(1, 9), is_lost=LOST)
    def refresh(self, steps, is_lost):
        self._say(self.counter + steps)
        if steps <= 8:  # else it reads as an old command
            self.counter += steps
            self.advanced_at_ms.append(self.now_ms)
        self._tick(is_lost)

    @rule(back=st.integers(0, 7), times=st.integers(1, 8))
    def old_commands(self, back, times):
        """A loop in the network, or a source that hangs: what was said is said again."""
        for _ in range(times):
            if self.advanced_at_ms and self.now_ms - self.advanced_at_ms[-1] < 100:
                self._say(self.counter - back)
            self.now_ms += 20
            self._tick()

    @rule(elapsed_ms=st.sampled_from([1, 3, 20, 60, 100, 300]))
    def time_passes(self, elapsed_ms):
        for _ in range(0, elapsed_ms, 20):
            self.now_ms += min(20, elapsed_ms)
            self._tick()

    @rule()
    def arm(self):
        accepted = self.guard.arm(self.now_ms * MS)
        assert accepted == (not self.is_stopped and self.stops_at_ms is None)
        self.is_armed = self.is_armed or accepted
        self._tick()

    @rule()
    def disarm(self):
        self.guard.disarm(self.now_ms * MS)
        self.is_armed = False
        self._tick()

    @rule()
    def stop(self):
        self.guard.stop(self.now_ms * MS, StopReason.OPERATOR)
        self.is_armed, self.is_stopped, self.stops_at_ms = False, True, None
        self._tick()

    @rule(grace_ms=st.sampled_from([1, 40, 100, 2000]))
    def announce_stop(self, grace_ms):
        self.guard.announce_stop(self.now_ms * MS, grace_ms / 1000)
        if not self.is_stopped:
            over_ms = self.now_ms + grace_ms
            self.stops_at_ms = over_ms if self.stops_at_ms is None else min(self.stops_at_ms, over_ms)
        self._tick()

    @rule()
    def release(self):
        self.guard.release_stop(self.now_ms * MS)
        if self.stops_at_ms is not None:
            self.is_armed, self.stops_at_ms = False, None
        self.is_stopped = False
        self._tick()

    @rule()
    def clock_goes_back_and_the_operator_releases(self):
        self.guard.tick((self.now_ms - 1) * MS)
        assert self.guard.stop_reason is not None
        self.guard.release_stop(self.now_ms * MS)
        self.is_armed = self.is_stopped = False
        self.stops_at_ms = None
        self.advanced_at_ms.clear()
        self._tick()

    @invariant()
    def nothing_is_open_unless_armed_fresh_and_not_stopped(self):
        received = [stamp for stamp in self.advanced_at_ms if self.now_ms - stamp < 100]
        if self.is_stopped or not self.is_armed or not received:
            assert self.last.open_mask == 0
            assert self.last.gate is not Gate.OPEN

    @invariant()
    def the_bus_carries_the_stop_first_and_what_is_left_of_its_grace(self):
        first = self.last.messages[0]
        assert isinstance(first, Stop) == (self.is_stopped or self.stops_at_ms is not None)
        if isinstance(first, Stop):
            left_ms = 0 if self.stops_at_ms is None else self.stops_at_ms - self.now_ms
            assert round(first.grace_s * 1e9) == left_ms * MS

    @invariant()
    def no_run_of_a_valve_is_longer_than_allowed(self):
        for intervals in self.node.intervals:
            run_since = closed_at = None
            for opened, closes in intervals:
                if closed_at is None or opened - closed_at >= 20:
                    run_since = opened
                closed_at = closes
                assert closes - run_since <= 250

    @invariant()
    def no_valve_is_open_more_than_its_share(self):
        for intervals in self.node.intervals:
            for first in range(max(0, len(intervals) - 40), len(intervals)):
                open_ms = sum(closes - opened for opened, closes in intervals[first:])
                span_ms = intervals[-1][1] - intervals[first][0]
                assert open_ms <= 0.4 * (span_ms + 1000) + 1e-6


GuardedValves.TestCase.settings = settings(
    max_examples=80, stateful_step_count=25, deadline=None, derandomize=True
)
test_the_guard_keeps_its_promises_on_a_bad_day = GuardedValves.TestCase
