"""The guard when it stops: at once, after a grace, and when the clock goes back."""

import pytest
from unit.drivers.valve_bus.commander import CLOSED, MS, ONE, WIDE, Source

from drivers.valve_bus.guard import Gate, Guard, OpenTimeLimits, Verdict
from drivers.valve_bus.messages import Arm, Stop, StopReason, ValveCommand


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
