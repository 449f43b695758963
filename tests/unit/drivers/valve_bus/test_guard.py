"""The guard: arming, pulses, silences, and how long a valve may be open."""

import itertools

import pytest
from unit.drivers.valve_bus.commander import CLOSED, MS, ONE, WIDE, Source

from drivers.valve_bus.guard import Gate, Guard, OpenTimeLimits, Verdict
from drivers.valve_bus.messages import Arm, ValveCommand


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


def test_half_of_the_counters_values_ahead_is_new_and_more_is_old(flying):
    assert flying.say(ONE, step=8) is Verdict.NEW_PULSE
    assert flying.say(ONE, step=9) is Verdict.COUNTER_BACKWARDS


def test_what_was_granted_whole_counts_as_clipped_by_nothing(flying):
    flying.say(ONE)
    flying.tick()
    assert (flying.guard.counters.clipped_by_run, flying.guard.counters.clipped_by_duty) == (0, 0)
