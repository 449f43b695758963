"""The valve writer: what reaches the wire, and what the valve node's frames become."""

import math

import pytest

from drivers.valve_bus import messages as bus
from drivers.valve_bus.frame import CanFrame
from drivers.valve_bus.protocol import decode, encode
from groundstation.parts.supervision.messages import StopPress, Supervision
from groundstation.parts.valves.messages import NO_STOP, CanIn, CanOut, ValveCommand, ValveStatus
from groundstation.parts.valves.valve_writer import ValveWriter

MS = 1_000_000
INDEX = 3


@pytest.fixture
def writer():
    return ValveWriter("alpha", INDEX)


def frames(outputs):
    outputs = list(outputs)
    assert all(isinstance(output, CanOut) and output.vehicle == "alpha" for output in outputs)
    return [decode(CanFrame(output.arbitration_id, output.data)) for output in outputs]


def command(stop_reason=NO_STOP, grace_s=0.0, arm=0):
    return ValveCommand(0, "alpha", 7, 5, bytes(range(8)), "open", 1, stop_reason, grace_s, arm)


def ruling(*, air_on):
    return Supervision(0, "alpha", "m", "l", False, air_on, False, math.inf, False, 0, "", "", 0, (), ())


def arrive(writer, message, now_ms=0):
    frame = encode(message)
    return list(writer.receive(CanIn(now_ms * MS, "", frame.arbitration_id, frame.data, 1), now_ms * MS))


def status(vehicle=INDEX, **changes):
    return bus.ValveStatus(
        **{
            "vehicle": vehicle, "open_mask": 5, "executed_counter": 9, "executed_pulse_id": 2, "counter": 1,
            "is_armed": True, "is_dead_man_closed": False, "is_stopped": False, "is_float_air_on": True,
            "node_faults": 1,
        } | changes
    )  # fmt: skip


def test_a_command_is_a_frame(writer):
    found = list(writer.receive(command(), 9))
    assert frames(found) == [bus.ValveCommand(INDEX, 7, 5, tuple(range(8)))]
    assert found[0].stamp_ns == 9


@pytest.mark.parametrize(("arm", "is_armed"), [(1, False), (2, True)])
def test_an_order_to_arm_or_disarm_goes_before_it(writer, arm, is_armed):
    found = frames(writer.receive(command(arm=arm), 0))
    assert found == [bus.Arm(INDEX, is_armed), bus.ValveCommand(INDEX, 7, 5, tuple(range(8)))]


@pytest.mark.parametrize("reason", list(bus.StopReason))
def test_a_stop_goes_before_everything(writer, reason):
    found = frames(writer.receive(command(stop_reason=int(reason), grace_s=1.5, arm=1), 0))
    assert found[0] == bus.Stop(INDEX, reason, 1.5)
    assert [type(message) for message in found[1:]] == [bus.Arm, bus.ValveCommand]


class TestAir:
    def test_before_the_first_ruling_nothing_is_ordered(self, writer):
        assert list(writer.tick(0)) == []

    @pytest.mark.parametrize("air_on", [False, True])
    def test_an_order_goes_out_at_once_and_again_until_the_node_reports_it(self, writer, air_on):
        (order,) = frames(writer.receive(ruling(air_on=air_on), 0))
        assert order == bus.FloatAir(INDEX, air_on, 1)
        assert list(writer.receive(ruling(air_on=air_on), 0)) == []
        assert frames(writer.tick(0)) == [bus.FloatAir(INDEX, air_on, 2)]
        arrive(writer, status(is_float_air_on=not air_on))
        assert frames(writer.tick(0)) == [bus.FloatAir(INDEX, air_on, 3)]
        arrive(writer, status(is_float_air_on=air_on))
        assert list(writer.tick(0)) == []

    def test_a_node_that_loses_its_air_is_ordered_again(self, writer):
        list(writer.receive(ruling(air_on=True), 0))
        arrive(writer, status(is_float_air_on=True))
        arrive(writer, status(is_float_air_on=False))
        assert frames(writer.tick(0)) == [bus.FloatAir(INDEX, True, 2)]

    def test_an_order_that_changes_goes_out_at_once(self, writer):
        list(writer.receive(ruling(air_on=True), 0))
        assert frames(writer.receive(ruling(air_on=False), 0)) == [bus.FloatAir(INDEX, False, 2)]

    def test_the_counter_of_orders_goes_round_at_sixteen(self, writer):
        list(writer.receive(ruling(air_on=True), 0))
        counters = [frames(writer.tick(0))[0].counter for _ in range(16)]
        assert counters == [*range(2, 16), 0, 1]


class TestReports:
    def test_a_status_that_waited_has_the_age_it_has(self, writer):
        frame = encode(status())
        (reported,) = writer.receive(CanIn(20 * MS, "", frame.arbitration_id, frame.data, 1), 2_500 * MS)
        assert reported.stamp_ns == 20 * MS

    @pytest.mark.parametrize("passed", [1, 160])
    def test_frames_that_passed_unseen_count_as_load_of_the_bus(self, writer, passed):
        frame = encode(status())
        for at_ms in range(0, 2_000, 20):
            message = CanIn(at_ms * MS, "", frame.arbitration_id, frame.data, passed)
            (reported,) = writer.receive(message, at_ms * MS)
        assert reported.bus_rate_hz == pytest.approx(50.0 * passed, rel=0.05)

    def test_a_status_is_published(self, writer):
        (reported,) = arrive(writer, status(), 20)
        assert isinstance(reported, ValveStatus)
        assert (reported.stamp_ns, reported.vehicle) == (20 * MS, "alpha")
        assert (reported.open_mask, reported.counter, reported.faults) == (5, 9, 1)
        assert (reported.armed, reported.dead_man, reported.floating) == (True, False, True)
        assert math.isnan(reported.pressure_pa)

    def test_a_coil_of_any_valve_is_told_by_the_highest_fault_bit(self, writer):
        for valve in range(8):
            (reported,) = arrive(writer, status(valve_fault_mask=1 << valve))
            assert reported.faults == 0x80 | 1
        (reported,) = arrive(writer, status(valve_fault_mask=0))
        assert reported.faults == 1

    def test_the_newest_tank_pressure_comes_with_it(self, writer):
        assert arrive(writer, bus.TankPressure(INDEX, 50e5, 6e5)) == []
        assert arrive(writer, bus.TankPressure(INDEX + 1, 90e5, 6e5)) == []
        (reported,) = arrive(writer, status())
        assert reported.pressure_pa == pytest.approx(50e5, rel=0.01)

    def test_what_another_node_reports_is_not_its_business(self, writer):
        assert arrive(writer, status(INDEX + 1)) == []
        list(writer.receive(ruling(air_on=True), 0))
        arrive(writer, status(INDEX + 1, is_float_air_on=True))
        assert len(list(writer.tick(0))) == 1

    def test_frames_that_are_none_are_ignored(self, writer):
        assert list(writer.receive(CanIn(0, "", 0x7FF, b"\x01", 1), 0)) == []


class TestButton:
    @pytest.mark.parametrize("address", [INDEX, bus.EVERY_VEHICLE])
    def test_a_stop_frame_is_a_press(self, writer, address):
        (press,) = arrive(writer, bus.Stop(address), 20)
        assert isinstance(press, StopPress)
        assert (press.stamp_ns, press.vehicle, press.press_id) == (20 * MS, "alpha", 1)
        assert press.author == "CAN button of alpha"

    def test_a_stop_of_another_vehicle_is_none(self, writer):
        assert arrive(writer, bus.Stop(INDEX + 1), 0) == []

    def test_frames_of_a_button_that_is_held_are_one_press(self, writer):
        assert len(arrive(writer, bus.Stop(INDEX), 0)) == 1
        for now_ms in (20, 299, 598, 897):
            assert arrive(writer, bus.Stop(INDEX), now_ms) == []

    def test_a_frame_after_a_pause_is_a_new_press(self, writer):
        arrive(writer, bus.Stop(INDEX), 0)
        (press,) = arrive(writer, bus.Stop(INDEX), 300)
        assert press.press_id == 2

    def test_the_very_first_frame_counts_even_at_the_beginning_of_time(self, writer):
        assert len(arrive(writer, bus.Stop(INDEX), 0)) == 1


def test_its_period(writer):
    assert writer.tick_period_ns == 100 * MS


def test_what_is_none_of_its_inputs_is_left_alone(writer):
    assert list(writer.receive(StopPress(0, "alpha", 1, "anna"), 0)) == []
