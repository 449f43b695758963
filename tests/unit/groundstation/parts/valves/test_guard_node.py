"""The shell of the guard: rulings, selections and what the valve node reports, by messages alone."""

import math

import pytest

from drivers.valve_bus.guard import Guard, OpenTimeLimits
from drivers.valve_bus.messages import StopReason
from groundstation.parts.operation.messages import Diagnostics
from groundstation.parts.supervision.messages import Supervision
from groundstation.parts.valves.guard_node import GuardNode
from groundstation.parts.valves.messages import NO_STOP, ValveCommand, ValveSelection, ValveStatus

MS = 1_000_000
CLOSED = bytes(8)
OPEN = bytes([50] * 8)


class Driven:
    """A guard node, a selection every 20 ms and a ruling every 100 ms."""

    def __init__(self):
        self.node = GuardNode("alpha", Guard(3, OpenTimeLimits(max_open_s=100.0, max_duty_ratio=1.0)))
        self.now_ms = self.counter = self.pulse_id = 0

    def select(self, on_time_ms=None):
        self.counter = (self.counter + 1) % 16
        if on_time_ms is not None:
            self.pulse_id = (self.pulse_id + 1) % 16
        chosen = on_time_ms or CLOSED
        selection = ValveSelection(0, "alpha", self.counter, self.pulse_id, chosen, "controller", "")
        return list(self.node.receive(selection, self.now_ms * MS))

    def rule(self, *, may_open=True, stop_latched=False, grace_s=math.inf):
        ruling = Supervision(
            0, "alpha", "m", "l", may_open, False, stop_latched, grace_s, False, 0, "", "", 0, (), ()
        )
        return list(self.node.receive(ruling, self.now_ms * MS))

    def report(self, *, armed):
        status = ValveStatus(0, "alpha", 0, 0, armed, False, True, math.nan, 0, 60.0)
        return list(self.node.receive(status, self.now_ms * MS))

    def tick(self, later_ms=0):
        self.now_ms += later_ms
        return next(iter(self.node.tick(self.now_ms * MS)))

    def fresh(self):
        """Two selections: a source is there."""
        self.select()
        self.select()
        return self


@pytest.fixture
def guard():
    return Driven().fresh()


@pytest.fixture
def armed(guard):
    guard.rule()
    return guard


def test_it_begins_closed_and_disarmed_and_has_nothing_to_say_of_stops(guard):
    command = guard.tick()
    assert (command.gate, command.open_mask, command.on_time_ms) == ("disarmed", 0, CLOSED)
    assert (command.stop_reason, command.stop_grace_s, command.arm) == (NO_STOP, 0.0, 0)
    assert (command.stamp_ns, command.vehicle) == (0, "alpha")


def test_a_ruling_arms_it_and_reaches_the_bus_at_once(guard):
    (command,) = guard.rule()
    assert (command.arm, command.gate) == (2, "open")
    assert guard.tick().arm == 0


def test_the_same_ruling_again_is_silent(armed):
    assert armed.rule() == []


def test_a_new_pulse_goes_out_at_once_and_a_refreshed_one_with_the_tick(armed):
    (command,) = armed.select(OPEN)
    assert (command.open_mask, command.on_time_ms) == (255, OPEN)
    assert armed.select() == []
    assert armed.tick(20).on_time_ms == bytes([30] * 8)


def test_a_pulse_while_disarmed_stays_closed(guard):
    (command,) = guard.select(OPEN)
    assert (command.gate, command.open_mask) == ("disarmed", 0)


def test_a_ruling_that_disarms_closes_at_once(armed):
    armed.select(OPEN)
    (command,) = armed.rule(may_open=False)
    assert (command.arm, command.gate, command.open_mask) == (1, "disarmed", 0)
    assert armed.rule(may_open=False) == []


def test_a_ruling_that_is_too_old_is_none(armed):
    for _ in range(25):
        armed.tick(20)
        armed.select()
    assert armed.tick().gate == "open"  # 500 ms
    armed.now_ms += 1
    command = armed.tick()
    assert (command.gate, command.arm) == ("disarmed", 1)
    assert armed.tick(20).arm == 0


def test_each_ruling_keeps_it_armed(armed):
    for _ in range(60):
        armed.tick(20)
        armed.select()
        armed.rule()
    assert armed.tick().gate == "open"


def test_a_guard_that_was_armed_otherwise_obeys_the_absence_of_rulings(guard):
    guard.node._guard.arm(0)
    assert guard.tick().gate == "disarmed"


class TestStop:
    def test_an_announced_stop_is_sent_first_and_commands_still_pass(self, armed):
        (command,) = armed.rule(stop_latched=True, grace_s=12.0)
        assert (command.stop_reason, command.stop_grace_s) == (int(StopReason.OPERATOR), 12.0)
        armed.now_ms += 20
        (command,) = armed.select(OPEN)
        assert (command.gate, command.open_mask, command.stop_grace_s) == ("open", 255, 11.98)
        assert armed.rule(stop_latched=True, grace_s=12.0) == []
        assert armed.tick().stop_grace_s == 11.98

    def test_a_stop_at_once_closes_and_stays_closed(self, armed):
        armed.select(OPEN)
        (command,) = armed.rule(may_open=False, stop_latched=True, grace_s=0.0)
        assert (command.gate, command.open_mask, command.stop_reason) == ("stopped", 0, 1)
        assert command.stop_grace_s == 0.0
        assert armed.rule(may_open=False, stop_latched=True, grace_s=0.0) == []
        assert armed.select(OPEN)[0].open_mask == 0

    def test_a_second_stop_is_one_stop(self, armed):
        for _ in range(3):
            armed.rule(may_open=False, stop_latched=True, grace_s=0.0)
        assert armed.node._guard.counters.stops == 1

    def test_the_end_of_braking_turns_an_announced_stop_into_one_at_once(self, armed):
        armed.rule(stop_latched=True, grace_s=12.0)
        (command,) = armed.rule(may_open=False, stop_latched=True, grace_s=0.0)
        assert (command.gate, command.stop_grace_s) == ("stopped", 0.0)

    def test_a_grace_that_is_over_stops_though_the_ruling_would_let_it_brake_on(self, armed):
        armed.rule(stop_latched=True, grace_s=0.1)
        armed.now_ms += 100
        armed.select(OPEN)
        armed.rule(stop_latched=True, grace_s=12.0)
        command = armed.tick()
        assert (command.gate, command.open_mask) == ("stopped", 0)

    def test_a_stop_that_is_released_lets_it_be_armed_again(self, armed):
        armed.rule(may_open=False, stop_latched=True, grace_s=0.0)
        (command,) = armed.rule(may_open=False)
        assert (command.gate, command.stop_reason) == ("disarmed", NO_STOP)
        (command,) = armed.rule()
        assert (command.gate, command.arm) == ("open", 2)

    def test_a_process_that_ends_leaves_a_stop(self, armed):
        armed.select(OPEN)
        (command,) = armed.node.stop(armed.now_ms * MS)
        assert (command.gate, command.open_mask, command.stop_reason) == (
            "stopped", 0, int(StopReason.SHUTDOWN),
        )  # fmt: skip


class TestOrderThatWasMissed:
    def test_a_node_that_stays_disarmed_is_armed_again_ten_times_a_second(self, armed):
        armed.tick()
        orders = []
        for _ in range(16):
            armed.report(armed=False)
            armed.select()
            armed.rule()
            orders.append(armed.tick(20).arm)
        assert orders == [0, 0, 0, 0, 0, 2] + [0, 0, 0, 0, 2] * 2

    @pytest.mark.parametrize(("later_ms", "order"), [(99, 0), (100, 2)])
    def test_it_is_given_a_tenth_of_a_second(self, armed, later_ms, order):
        armed.tick()
        armed.now_ms += later_ms
        armed.report(armed=False)
        assert armed.tick().arm == order

    def test_a_node_that_is_armed_is_left_alone(self, armed):
        armed.tick()
        armed.now_ms += 200
        assert armed.report(armed=True) == []
        assert armed.tick().arm == 0

    def test_a_node_that_is_to_be_disarmed_is_left_alone(self, guard):
        guard.rule(may_open=False)
        guard.tick()
        guard.now_ms += 200
        guard.report(armed=False)
        assert guard.tick().arm == 0

    def test_while_a_stop_is_announced_it_is_not_armed_again(self, armed):
        armed.rule(stop_latched=True, grace_s=12.0)
        armed.now_ms += 200
        armed.report(armed=False)
        assert armed.tick().arm == 0


def test_counters_are_reported_once_a_second(armed):
    reports = []
    for number in range(1, 101):
        armed.now_ms += 20
        outputs = list(armed.node.tick(armed.now_ms * MS))
        assert isinstance(outputs[0], ValveCommand)
        reports += [(number, message) for message in outputs[1:]]
    assert [number for number, _ in reports] == [50, 100]
    report = reports[0][1]
    assert isinstance(report, Diagnostics)
    assert (report.node, report.level, report.stamp_ns) == ("alpha/guard", 0, 1000 * MS)
    counters = dict(zip(report.keys, report.values, strict=True))
    assert counters["commands"] == "2"
    assert counters["first_after_silence"] == "1"


def test_its_period(guard):
    assert guard.node.tick_period_ns == 20 * MS
