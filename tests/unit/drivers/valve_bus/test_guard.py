import itertools

import pytest

from drivers.valve_bus.guard import Gate, Guard, OpenTimeLimits, Verdict
from drivers.valve_bus.messages import Arm, Stop, StopReason, ValveCommand

MS = 1_000_000
WIDE = OpenTimeLimits(max_open_s=100.0, max_duty_ratio=1.0, duty_window_s=100.0)
CLOSED = (0,) * 8
ONE = (50, 0, 0, 0, 0, 0, 0, 0)


class Source:
    """Somebody who commands every 20 ms and ticks right after."""

    def __init__(self, guard, start_ms=0):
        self.guard, self.now_ms, self.counter, self.pulse_id = guard, start_ms, 0, 0

    def say(self, on_times_ms=None, step=1):
        self.counter = (self.counter + step) % 16
        if on_times_ms is not None:
            self.pulse_id = (self.pulse_id + 1) % 16
            self.times = on_times_ms
        times = getattr(self, "times", CLOSED)
        return self.guard.update(self.now_ms * MS, ValveCommand(1, self.counter, self.pulse_id, times))

    def tick(self, later_ms=0):
        self.now_ms += later_ms
        return self.guard.tick(self.now_ms * MS)


@pytest.fixture
def flying():
    source = Source(Guard(1, WIDE))
    source.say()
    source.say()
    assert source.guard.arm(source.now_ms * MS)
    source.tick()
    return source


def test_a_new_guard_is_disarmed_and_closed():
    guard = Guard(1, WIDE)
    output = guard.tick(0)
    assert not guard.is_armed
    assert output.gate is Gate.DISARMED
    assert output.open_mask == 0
    assert output.messages == (ValveCommand(1, 0, 0, CLOSED),)


def test_an_armed_guard_sends_a_new_pulse_once_and_then_what_remains(flying):
    assert flying.say(ONE) is Verdict.NEW_PULSE
    first = flying.tick()
    assert (first.gate, first.open_mask, first.command.on_times_ms[0]) == (Gate.OPEN, 1, 50)
    second = flying.tick(20)
    assert second.command.pulse_id == first.command.pulse_id
    assert second.command.on_times_ms[0] == 30
    assert second.command.counter == first.command.counter + 1
    assert flying.tick(30).open_mask == 0


def test_arming_and_disarming_are_said_once_on_the_bus(flying):
    guard = flying.guard
    guard.disarm(0)
    assert Arm(1, is_armed=False) in flying.tick().messages
    assert len(flying.tick().messages) == 1
    assert guard.arm(0)
    assert Arm(1, is_armed=True) in flying.tick().messages


def test_disarming_closes_what_is_open(flying):
    flying.say(ONE)
    before = flying.tick()
    flying.guard.disarm(flying.now_ms * MS)
    after = flying.tick()
    assert after.open_mask == 0
    assert after.command.on_times_ms == CLOSED
    assert after.command.pulse_id == (before.command.pulse_id + 1) % 16
    assert flying.guard.counters.stale_cuts == 0


def test_a_pulse_asked_for_while_disarmed_is_never_sent(flying):
    flying.guard.disarm(0)
    assert flying.say(ONE) is Verdict.NEW_PULSE
    assert flying.guard.arm(0)
    assert flying.tick().open_mask == 0
    assert flying.say() is Verdict.REFRESHED
    assert flying.tick().open_mask == 0


def test_a_pulse_waiting_for_its_tick_dies_with_arming_anew(flying):
    flying.say(ONE)
    flying.guard.arm(0)
    assert flying.tick().open_mask == 0


def test_silence_of_100_ms_closes_all(flying):
    flying.say((127,) * 8)
    flying.tick()
    assert flying.tick(99).open_mask == 0xFF
    output = flying.tick(1)
    assert (output.gate, output.open_mask) == (Gate.STALE, 0)
    assert flying.guard.counters.stale_cuts == 1
    assert flying.tick(1).command.pulse_id == output.command.pulse_id


def test_one_command_after_silence_is_not_yet_a_source(flying):
    flying.tick(200)
    before = flying.guard.counters.first_after_silence
    assert flying.say(ONE) is Verdict.FIRST_AFTER_SILENCE
    assert flying.guard.counters.first_after_silence == before + 1
    assert flying.tick().gate is Gate.STALE
    assert flying.say() is Verdict.REFRESHED
    output = flying.tick()
    assert (output.gate, output.open_mask) == (Gate.OPEN, 0)
    flying.say(ONE)
    assert flying.tick().open_mask == 1


def test_a_silence_that_no_tick_saw_still_ends_the_pulse(flying):
    flying.say((127,) * 8)
    flying.tick()
    flying.now_ms += 110
    flying.say()
    flying.say()
    assert flying.tick().open_mask == 0
    assert flying.guard.counters.stale_cuts == 1


def test_a_pulse_from_before_a_silence_is_not_sent_after_it(flying):
    flying.say(ONE)
    flying.now_ms += 110
    flying.say()
    flying.say()
    assert flying.tick().open_mask == 0


def test_a_repeated_counter_does_not_keep_a_command_fresh(flying):
    flying.say(ONE)
    for _ in range(5):
        flying.now_ms += 20
        assert flying.say(step=0) is Verdict.REPEATED_COUNTER
    assert flying.tick().gate is Gate.STALE
    assert flying.guard.counters.repeated_counter == 5


def test_an_older_command_is_refused_and_gaps_are_counted(flying):
    assert flying.say(ONE, step=3) is Verdict.NEW_PULSE
    assert flying.guard.counters.lost_commands == 2
    assert flying.say(ONE, step=-1) is Verdict.COUNTER_BACKWARDS
    assert flying.guard.counters.counter_backwards == 1


def test_the_newest_pulse_of_one_tick_wins(flying):
    flying.say((10,) * 8)
    flying.say((20,) * 8)
    assert flying.tick().command.on_times_ms == (20,) * 8
    assert flying.guard.counters.superseded_pulses == 1
    assert flying.guard.counters.new_pulses == 2


def test_pulses_that_each_had_their_tick_superseded_nothing(flying):
    for _ in range(3):
        flying.say(ONE)
        flying.tick()
    assert flying.guard.counters.superseded_pulses == 0


def test_pulse_ids_go_up_by_one_and_round_at_sixteen(flying):
    ids = []
    for _ in range(17):
        flying.say(ONE)
        ids.append(flying.tick().command.pulse_id)
    assert ids == [(ids[0] + step) % 16 for step in range(17)]


def test_commands_for_others_and_malformed_ones_are_refused(flying):
    guard = flying.guard
    before = guard.counters.commands
    assert guard.update(0, ValveCommand(2, 3, 3, ONE)) is Verdict.OTHER_VEHICLE
    bad = [(16, 0, ONE), (0, 16, ONE), (-1, 0, ONE), (0, -1, ONE), (0, 0, ONE[:7]), (0, 0, (128, *ONE[1:]))]
    bad += [(0, 0, (-1, *ONE[1:])), (0, 0, (1.5, *ONE[1:]))]
    for counter, pulse_id, times in bad:
        assert guard.update(0, ValveCommand(1, counter, pulse_id, times)) is Verdict.MALFORMED
    assert guard.counters.malformed == len(bad)
    assert guard.counters.commands - before == 1 + len(bad)
    assert guard.counters.other_vehicle == 1


def test_a_stop_latches_disarms_and_is_repeated(flying):
    guard = flying.guard
    flying.say(ONE)
    flying.tick()
    guard.stop(0, StopReason.OPERATOR)
    guard.stop(0, StopReason.SHUTDOWN)
    for _ in range(3):
        output = flying.tick()
        assert output.gate is Gate.STOPPED
        assert output.open_mask == 0
        assert isinstance(output.messages[0], Stop)
        assert output.messages[-1] is output.command
    assert guard.stop_reason is StopReason.OPERATOR  # the first says why
    assert guard.counters.stops == 1
    assert not guard.arm(0)
    assert not guard.is_armed


def test_a_released_stop_leaves_the_guard_disarmed(flying):
    flying.guard.stop(0, StopReason.OPERATOR)
    flying.guard.release_stop(0)
    assert flying.tick().gate is Gate.DISARMED
    assert flying.guard.arm(0)
    flying.say(ONE)
    assert flying.tick().open_mask == 1


def test_an_announced_stop_lets_commands_pass_until_its_grace_is_over(flying):
    start_ms = flying.now_ms
    flying.guard.announce_stop(start_ms * MS, 0.5)
    assert flying.guard.is_stop_announced
    assert flying.guard.stop_reason is None
    while flying.now_ms < start_ms + 480:
        flying.say(ONE)
        output = flying.tick()
        left_s = (start_ms + 500 - flying.now_ms) / 1000
        assert output.messages[0] == Stop(1, StopReason.OPERATOR, left_s)
        assert output.messages[-1] is output.command
        assert (output.gate, output.open_mask, output.command.on_times_ms) == (Gate.OPEN, 1, ONE)
        flying.now_ms += 20
    flying.say(ONE)
    flying.tick()
    ns = (start_ms + 500) * MS
    assert flying.guard.tick(ns - 1).gate is Gate.OPEN
    assert flying.guard.is_armed
    last = flying.guard.tick(ns)
    assert last.messages == (Stop(1, StopReason.OPERATOR), last.command)
    assert (last.gate, last.open_mask, last.command.on_times_ms) == (Gate.STOPPED, 0, CLOSED)
    assert flying.guard.stop_reason is StopReason.OPERATOR
    assert not flying.guard.is_armed
    assert not flying.guard.is_stop_announced
    assert flying.guard.counters.stops == 1


def test_the_grace_of_a_stop_ends_for_whoever_asks_first(flying):
    flying.guard.announce_stop(0, 0.1)
    flying.now_ms = 100
    flying.say(ONE)  # not a tick
    assert flying.guard.stop_reason is StopReason.OPERATOR
    assert flying.tick().open_mask == 0


@pytest.mark.parametrize(
    ("second_s", "over_ms"), [(5.0, 1000), (0.81, 1000), (0.8, 1000), (0.79, 990), (0.1, 300)]
)
def test_a_second_announcement_shortens_the_grace_and_never_lengthens_it(flying, second_s, over_ms):
    flying.guard.announce_stop(0, 1.0)
    flying.guard.announce_stop(200 * MS, second_s)
    assert flying.guard.tick(over_ms * MS - 1).messages[0] == Stop(1, StopReason.OPERATOR, 1e-9)
    assert flying.guard.tick(over_ms * MS).gate is Gate.STOPPED


@pytest.mark.parametrize("grace_s", [0.0, -1.0, float("nan")])
def test_an_announcement_without_grace_stops_at_once(flying, grace_s):
    flying.guard.announce_stop(0, grace_s)
    assert flying.guard.stop_reason is StopReason.OPERATOR
    assert flying.tick().messages[0] == Stop(1, StopReason.OPERATOR)


def test_a_grace_is_at_most_what_the_frame_carries(flying):
    flying.guard.announce_stop(0, float("inf"))
    assert flying.guard.tick(0).messages[0] == Stop(1, StopReason.OPERATOR, 25.5)


def test_nobody_arms_while_a_stop_is_announced(flying):
    flying.guard.announce_stop(0, 1.0)
    flying.guard.disarm(0)
    assert not flying.guard.arm(0)
    output = flying.tick()
    assert output.messages[:2] == (Stop(1, StopReason.OPERATOR, 1.0), Arm(1, is_armed=False))
    assert output.gate is Gate.DISARMED


def test_a_hard_stop_ends_the_grace(flying):
    flying.guard.announce_stop(0, 1.0)
    flying.guard.stop(0, StopReason.GUARD)
    flying.guard.announce_stop(0, 1.0)
    assert flying.guard.stop_reason is StopReason.GUARD
    assert not flying.guard.is_stop_announced
    assert flying.tick().messages[0] == Stop(1, StopReason.GUARD)


def test_a_released_announcement_leaves_the_guard_disarmed(flying):
    flying.guard.announce_stop(0, 1.0)
    flying.guard.release_stop(0)
    assert not flying.guard.is_armed
    assert not flying.guard.is_stop_announced
    output = flying.tick()
    assert output.messages == (Arm(1, is_armed=False), output.command)
    assert output.gate is Gate.DISARMED
    assert flying.guard.tick(2000 * MS).gate is Gate.DISARMED  # and no stop comes later
    assert flying.guard.arm(2000 * MS)


def test_a_clock_that_goes_back_stops_whatever_the_grace(flying):
    flying.now_ms = 1000
    flying.guard.announce_stop(flying.now_ms * MS, 5.0)
    assert flying.tick(-500).gate is Gate.STOPPED
    assert flying.guard.stop_reason is StopReason.GUARD
    assert not flying.guard.is_stop_announced


def test_a_clock_that_goes_back_stops(flying):
    flying.now_ms = 1000
    flying.tick()
    flying.say()
    flying.say((127,) * 8)
    output = flying.tick(-500)
    assert (output.gate, output.open_mask) == (Gate.STOPPED, 0)
    assert flying.guard.stop_reason is StopReason.GUARD
    assert flying.guard.counters.clock_went_back == 1
    flying.guard.release_stop(flying.now_ms * MS)
    assert flying.guard.arm(flying.now_ms * MS)
    assert flying.say(ONE) is Verdict.FIRST_AFTER_SILENCE
    flying.say()
    flying.say(ONE)
    assert flying.tick().open_mask == 1


def test_a_clock_that_went_back_costs_no_valve_its_open_time():
    source = Source(Guard(1, OpenTimeLimits(max_duty_ratio=0.5, duty_window_s=1.0)), start_ms=3_600_000)
    source.tick()
    source.tick(-3_600_000)
    source.guard.release_stop(0)
    source.guard.arm(0)
    source.say()
    source.say()
    source.say(ONE)
    assert source.tick().command.on_times_ms == ONE


def test_no_valve_stays_open_longer_than_the_longest_run():
    source = Source(Guard(1, OpenTimeLimits(max_open_s=0.3, min_rest_s=0.02, max_duty_ratio=1.0)))
    source.say()
    source.say()
    source.guard.arm(0)
    open_at_ms = []
    for now_ms in range(0, 1000, 5):
        source.now_ms = now_ms
        if now_ms % 20 == 0:
            source.say((127,) + (0,) * 7)
        if source.tick().open_mask:
            open_at_ms.append(now_ms)
    gaps = [b - a for a, b in itertools.pairwise(open_at_ms)]
    assert open_at_ms[0] == 0
    assert max(gaps) > 20
    assert gaps.index(max(gaps)) * 5 <= 300
    assert source.guard.counters.clipped_by_run > 0


def test_no_valve_is_open_more_than_its_duty_allows():
    source = Source(Guard(1, OpenTimeLimits(max_open_s=10.0, max_duty_ratio=0.25, duty_window_s=1.0)))
    source.say()
    source.say()
    source.guard.arm(0)
    open_ms = 0
    for now_ms in range(0, 10_000, 20):
        source.now_ms = now_ms
        source.say((20,) + (0,) * 7)
        open_ms += source.tick().command.on_times_ms[0]
    assert 0.25 * 10_000 <= open_ms <= 0.25 * 11_000
    assert source.guard.counters.clipped_by_duty > 0


def test_a_valve_with_no_duty_never_opens(flying):
    flying.guard = Guard(1, OpenTimeLimits(max_duty_ratio=0.0))
    flying.say()
    flying.say()
    flying.guard.arm(0)
    flying.say(ONE)
    assert flying.tick().open_mask == 0


@pytest.mark.parametrize(
    "limits",
    [{"max_open_s": 0.0}, {"min_rest_s": -1.0}, {"duty_window_s": float("nan")}, {"max_duty_ratio": 1.5}],
)
def test_senseless_limits_are_refused(limits):
    with pytest.raises(ValueError, match=next(iter(limits))):
        OpenTimeLimits(**limits)


@pytest.mark.parametrize(
    "order",
    [
        lambda guard, ns: guard.arm(ns),
        lambda guard, ns: guard.disarm(ns),
        lambda guard, ns: guard.stop(ns, StopReason.OPERATOR),
        lambda guard, ns: guard.announce_stop(ns, 1.0),
        lambda guard, ns: guard.release_stop(ns),
        lambda guard, ns: guard.update(ns, ValveCommand(1, 5, 5, ONE)),
        lambda guard, ns: guard.tick(ns),
    ],
)
def test_a_clock_that_goes_back_is_noticed_by_whatever_asks_first(order):
    guard = Guard(1, WIDE)
    guard.tick(1000 * MS)
    order(guard, 400 * MS)
    assert guard.counters.clock_went_back == 1
    assert not guard.is_armed


def test_the_guards_own_time_stands_still_while_the_clock_goes_back():
    guard = Guard(1, WIDE)
    guard.tick(1000 * MS)
    assert guard._advance(400 * MS) == 1000 * MS
    assert guard._advance(450 * MS) == 1050 * MS
    assert guard._advance(350 * MS) == 1050 * MS


def test_half_of_the_counters_values_ahead_is_new_and_more_is_old(flying):
    assert flying.say(ONE, step=8) is Verdict.NEW_PULSE
    assert flying.say(ONE, step=9) is Verdict.COUNTER_BACKWARDS


def test_what_was_granted_whole_counts_as_clipped_by_nothing(flying):
    flying.say(ONE)
    flying.tick()
    assert (flying.guard.counters.clipped_by_run, flying.guard.counters.clipped_by_duty) == (0, 0)
