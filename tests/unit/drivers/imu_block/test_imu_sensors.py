"""Counts to physical values, and readings that cannot be true."""

import math

import pytest

from drivers.imu_block.protocol import (
    FrameParser,
    Housekeeping,
    HousekeepingItem,
    Status,
    encode_v1,
    encode_v2,
)
from drivers.imu_block.sensors import (
    ALL_READINGS,
    Environment,
    Plausibility,
    Reading,
    SensorFault,
    rate_rad_s,
    specific_force_m_s2,
    temperature_gyro_c,
    temperature_tilt_c,
    usable_readings,
)


def frame(gyro=2048.0, tilts=(1024.0, 1024.0, 1024.0, 1024.0), item=0, value=2048, attention=False):
    wire = encode_v2(
        tick_ms=1, sample_count=1, gyro_counts=gyro, tilt_counts=tilts,
        housekeeping=Housekeeping(item, value), attention=attention,
    )  # fmt: skip
    return FrameParser(2).feed(wire)[0]


def v1_frames(x):
    wire = b"".join(
        encode_v1(sequence=k, gyro_counts=2048, tilt_difference_counts=(x, 0)) for k in range(1, 4)
    )
    return FrameParser(1).feed(wire)


def test_scales_are_those_of_the_data_sheets():
    assert math.degrees(rate_rad_s(2048 + 1230)) == pytest.approx(300, abs=0.01)
    assert rate_rad_s(2047) < 0 < rate_rad_s(2049)
    assert specific_force_m_s2(6554) == pytest.approx(9.80665)
    assert math.degrees(math.asin(specific_force_m_s2(57.12) / 9.80665)) == pytest.approx(0.4994, abs=1e-3)
    assert temperature_gyro_c(2048) == 25
    assert temperature_gyro_c(2048 + 688) == pytest.approx(125, abs=0.1)
    assert temperature_tilt_c(197 - 1.083 * 40) == pytest.approx(40)


def test_a_quiet_block_has_no_faults():
    watch = Plausibility()
    assert [watch.update(frame()) for _ in range(5)] == [SensorFault(0)] * 5


@pytest.mark.parametrize(
    ("tilts", "fault"),
    [
        ((101, 1947, 1024, 1024), SensorFault.TILT_X_WINDOW),
        ((1024, 1024, 1946, 102), SensorFault.TILT_Y_WINDOW),
        ((1024, 1065, 1024, 1024), SensorFault.TILT_X_SUM),
        ((1024, 1024, 1000, 1007), SensorFault.TILT_Y_SUM),
    ],
)
def test_a_tilt_fault_is_one_only_when_it_lasts(tilts, fault):
    watch = Plausibility()
    assert watch.update(frame(tilts=tilts)) == SensorFault(0)
    assert watch.update(frame()) == SensorFault(0)
    assert watch.update(frame(tilts=tilts)) == SensorFault(0)
    assert watch.update(frame(tilts=tilts)) == fault
    assert watch.update(frame()) == SensorFault(0)


def test_tilt_at_the_window_s_edge_is_still_tilt():
    watch = Plausibility()
    watch.update(frame(tilts=(102, 1945, 1945, 102)))
    assert watch.update(frame(tilts=(102, 1945, 1945, 102))) == SensorFault(0)


def test_v1_faults_show_in_the_difference_alone():
    watch = Plausibility()
    assert [watch.update(f) for f in v1_frames(1900)][-1] == SensorFault.TILT_X_WINDOW
    assert [Plausibility().update(f) for f in v1_frames(1800)][-1] == SensorFault(0)


def test_a_gyro_that_jumps_or_saturates_is_named_at_once():
    watch = Plausibility()
    watch.update(frame())
    assert watch.update(frame(gyro=2700)) == SensorFault.GYRO_STEP
    assert watch.update(frame(gyro=3279)) == SensorFault.GYRO_RANGE


def test_what_the_block_reports_is_passed_on():
    faults = Plausibility().update(frame(), Status.FAULT_TILT_Y | Status.SELF_TEST | Status.RESET_WATCHDOG)
    assert faults == SensorFault.REPORTED_TILT_Y | SensorFault.SELF_TEST


def test_slow_quantities_are_collected_and_unknown_until_heard():
    environment = Environment()
    environment.update(v1_frames(0)[0])
    assert math.isnan(environment.temperature_gyro_c)
    for item, value in (
        (HousekeepingItem.TEMPERATURE_GYRO, 2048),
        (HousekeepingItem.TEMPERATURE_TILT_X, 170),
        (HousekeepingItem.TEMPERATURE_TILT_Y, 165),
        (HousekeepingItem.STATUS, 0x0304),
    ):
        environment.update(frame(item=item, value=value))
    assert environment.temperature_gyro_c == 25
    assert environment.temperature_tilt_x_c == pytest.approx(24.93, abs=0.01)
    assert environment.temperature_tilt_y_c == pytest.approx(29.55, abs=0.01)
    assert (environment.status, environment.commands_refused) == (Status.RESET_WATCHDOG, 3)


def test_a_gyro_code_that_never_moves_for_half_a_second_is_stuck_until_it_moves():
    watch = Plausibility()
    faults = [watch.update(frame()) for _ in range(501)]
    assert faults[:500] == [SensorFault(0)] * 500
    assert faults[500] == SensorFault.GYRO_STUCK
    assert watch.update(frame(gyro=2048.25)) == SensorFault(0)


@pytest.mark.parametrize("fault", list(SensorFault))
def test_a_fault_costs_its_own_reading_and_a_self_test_all(fault):
    left = usable_readings(fault)
    if fault in (SensorFault.SELF_TEST, SensorFault.ATTENTION):
        assert left == Reading(0)
    else:
        lost = ALL_READINGS & ~left
        names = {Reading.RATE: "GYRO", Reading.FORCE_X: "TILT_X", Reading.FORCE_Y: "TILT_Y"}
        assert names[lost] in fault.name
    assert usable_readings(SensorFault(0)) == ALL_READINGS
    assert usable_readings(SensorFault.TILT_X_SUM | SensorFault.TILT_Y_SUM) == Reading.RATE


def usable_in(watch, environment, frames):
    """What each frame leaves usable, told as the reader tells it."""
    left = []
    for each in frames:
        environment.update(each)
        left.append(usable_readings(watch.update(each, environment.status)))
    return left


@pytest.mark.parametrize("before", [0, 1, 2, 3])
@pytest.mark.parametrize(
    ("bit", "left"),
    [
        (Status.SELF_TEST, Reading(0)),
        (Status.FAULT_GYRO, Reading.FORCE_X | Reading.FORCE_Y),
        (Status.FAULT_TILT_X, Reading.RATE | Reading.FORCE_Y),
        (Status.FAULT_TILT_Y, Reading.RATE | Reading.FORCE_X),
    ],
)
def test_attention_leaves_nothing_until_the_status_says_what_it_is(bit, left, before):
    watch, environment = Plausibility(), Environment()
    calm = [frame(item=item, value=0 if item == 3 else 170, gyro=2048 + item) for item in range(4)]
    assert usable_in(watch, environment, calm) == [ALL_READINGS] * 4
    raised = [frame(item=item, value=170, attention=True, gyro=1827) for item in range(before)]
    assert usable_in(watch, environment, raised) == [Reading(0)] * before
    said = frame(item=3, value=int(bit), attention=True, gyro=1828)
    later = frame(item=0, value=2048, attention=True, gyro=1829)
    assert usable_in(watch, environment, [said, later]) == [left, left]
    over = [frame(item=3, value=0), frame(item=0, value=2048, attention=True, gyro=2047)]
    assert usable_in(watch, environment, over) == [ALL_READINGS, Reading(0)]  # raised anew: anew unknown


def test_attention_without_a_reason_stays_unknown():
    watch, environment = Plausibility(), Environment()
    frames = [frame(item=3, value=0x0001, attention=True, gyro=2048 + k) for k in range(4)]
    assert usable_in(watch, environment, frames) == [Reading(0)] * 4


@pytest.mark.parametrize("spike", [900.0, 3500.0, 0.0])
def test_a_spike_costs_its_own_frame_and_a_lasting_step_its_first(spike):
    watch = Plausibility()
    codes = [2048, 2049, spike, 2048, 2049, spike, spike + 1, spike]
    steps = [bool(watch.update(frame(gyro=code)) & SensorFault.GYRO_STEP) for code in codes]
    assert steps == [False, False, True, False, False, True, False, False]
