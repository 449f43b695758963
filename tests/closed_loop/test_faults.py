"""What goes wrong in the laboratory is counted under its name, and the vehicle survives it."""

import math

import numpy as np
import pytest

from groundstation.parts.fusion.messages import FixAccount, FusionStatus, VehicleState
from groundstation.parts.imu.messages import Imu
from groundstation.parts.operation.messages import Diagnostics
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.supervision.messages import Faults, ValveShares
from groundstation.parts.valves.messages import ValveCommand, ValveDemand, ValveSelection, ValveStatus
from groundstation.supervision.faults import FAULTS

FAULT_S, END_S, STOP_S = 4.0, 6.0, 8.0


def fault(kind, **parameters):
    """A row of the scenario: the fault lasts from FAULT_S to END_S."""
    inner = ", ".join(f"{name} = {float(value)}" for name, value in parameters.items())
    return (
        f'\n[[laboratory.faults]]\nkind = "{kind}"\nvehicle = "alpha"\n'
        f"start_s = {FAULT_S}\nend_s = {END_S}\nparameters = {{ {inner} }}\n"
    )


def assert_survived(flight):
    """It flies on, on the table, near its goal, with a state that agrees with truth."""
    assert flight.modes()[-1] == "flying"
    truth = flight.of(ReferenceState, start_s=STOP_S - 0.5)
    states = flight.of(VehicleState, start_s=STOP_S - 0.5)
    assert states
    assert states[-1].status == "flying"
    error = np.subtract(states[-1].position_table_m, truth[-1].position_table_m)
    assert np.hypot(*error) < 0.02
    distances, _ = flight.off_goal(start_s=STOP_S - 0.5)
    assert distances.max() < 0.4
    assert flight.of(ValveCommand, start_s=STOP_S - 0.1)[-1].gate == "open"


@pytest.mark.parametrize(
    ("kind", "parameters", "counter"),
    [
        ("bit_flips", {"probability_per_bit": 1e-3}, "rejected_crc"),
        ("lost_bytes", {"probability_per_byte": 1e-2}, "frames_lost"),
        ("half_frames", {"probability_per_frame": 0.2}, "frames_lost"),
    ],
)
def test_noise_on_the_line_is_counted_by_its_name(fly, kind, parameters, counter):
    flight = fly(fault(kind, **parameters)).run(STOP_S)
    assert_survived(flight)
    assert flight.counters("alpha/imu_reader")[counter] > 0


def test_a_gyro_that_reads_the_end_of_its_scale_is_named_and_not_believed(fly):
    flight = fly(fault("stuck_gyro", code=0)).run(STOP_S)
    samples = flight.of(Imu, start_s=FAULT_S + 0.1, stop_s=END_S)
    assert all("gyro_range" in imu.reason for imu in samples)
    assert not any(imu.valid for imu in samples)
    assert_landed(flight, "imu_stuck")
    assert flight.run(6.0).modes()[-1] == "landed"  # a code that never changes is for a person to clear
    flight.request("fly")
    assert flight.run(4.0).modes()[-1] == "flying"


def assert_landed(flight, fault):
    """The fault was named within a second of its beginning, and the vehicle is down, near its goal."""
    first = next(row for row in flight.of(Faults, start_s=FAULT_S) if fault in row.ids)
    assert first.stamp_ns * 1e-9 < FAULT_S + 1.0
    assert not flight.of(ValveStatus)[-1].floating
    truth = flight.of(ReferenceState)[-1]
    assert truth.velocity_table_m_s == (0.0, 0.0)
    assert flight.off_goal()[0][-1] < 0.3


def test_a_gyro_stuck_near_its_null_lands_the_vehicle_until_a_person_lets_it_fly(fly):
    flight = fly(fault("stuck_gyro")).run(STOP_S + 6.0)
    late = flight.of(Imu, start_s=FAULT_S + 0.6, stop_s=END_S - 0.1)
    assert {imu.reason for imu in late} == {"gyro_stuck"}
    assert_landed(flight, "imu_stuck")
    assert flight.modes()[-1] == "landed"
    flight.request("fly")
    assert flight.run(6.0).modes()[-1] == "flying"


@pytest.mark.provokes("accelerometer_lost")
@pytest.mark.parametrize(("axis", "name", "usable"), [(0, "x", 0b101), (1, "y", 0b011)])
def test_a_tilt_chip_that_dies_is_named_and_the_vehicle_flies_on_without_it(fly, axis, name, usable):
    flight = fly(fault("dead_tilt", axis=axis)).run(STOP_S)
    dead = flight.of(Imu, start_s=FAULT_S + 0.1, stop_s=END_S - 0.1)
    assert all(f"tilt_{name}" in imu.reason and not imu.valid and imu.usable == usable for imu in dead)
    found = next(row for row in flight.of(Faults) if "accelerometer_lost" in row.ids)
    assert FAULT_S < found.stamp_ns * 1e-9 < FAULT_S + FAULTS["accelerometer_lost"].within_s
    reported = {row.summary for row in flight.published[Diagnostics] if row.node == "alpha/fusion"}
    assert (
        f"alpha/fusion: accelerometer {name} not believed: flying by gyro, fixes and valve commands"
        in reported
    )
    # one state per sample, and it is right: the valves are known to have pushed
    states = flight.of(VehicleState, start_s=FAULT_S + 0.1, stop_s=END_S - 0.1)
    assert len(states) == len(dead)
    assert all(state.status == "flying" for state in states)
    truth = flight.of(ReferenceState, stop_s=END_S)[-1]
    at = min(states, key=lambda state: abs(state.stamp_ns - truth.stamp_ns))
    assert math.dist(at.position_table_m, truth.position_table_m) < 0.015
    assert all(row.source == "controller" for row in flight.of(ValveSelection, start_s=FAULT_S, stop_s=END_S))
    assert_survived(flight)


@pytest.mark.slow
def test_without_both_tilt_chips_a_station_is_kept_for_half_a_minute(fly):
    both = "".join(
        fault("dead_tilt", axis=axis).replace(f"end_s = {END_S}", "end_s = 60.0") for axis in (0, 1)
    )
    flight = fly(both).run(36.0)
    distances, _ = flight.off_goal(start_s=24.0)
    assert distances.max() < 0.06
    truth = flight.of(ReferenceState)[-1]
    assert math.dist(flight.of(VehicleState)[-1].position_table_m, truth.position_table_m) < 0.03


def test_without_stars_the_age_of_the_fix_grows_and_the_vehicle_holds_on(fly):
    flight = fly(fault("dead_sky")).run(STOP_S)
    before_end = flight.of(FusionStatus, start_s=END_S - 0.3, stop_s=END_S)
    assert before_end[-1].fix_age_s > END_S - FAULT_S - 0.3
    assert_survived(flight)


def test_a_frozen_camera_is_named_and_lands_the_vehicle(fly):
    flight = fly(fault("frozen_camera")).run(STOP_S + 1.0)
    first = next(row for row in flight.of(Faults) if "camera_frozen" in row.ids)
    assert first.stamp_ns * 1e-9 < FAULT_S + 2.0  # two fixes of 0.67 s, 0.6 s late
    assert flight.modes(start_s=FAULT_S)[:4] == ["flying", "braking", "holding", "landing"]


def test_wrong_fixes_are_refused_and_counted(fly):
    flight = fly(fault("false_lights")).run(STOP_S)
    refused = [row for row in flight.of(FixAccount, start_s=FAULT_S) if not row.used]
    assert refused
    assert all(row.reason for row in refused)
    assert flight.of(FusionStatus)[-1].fixes_refused >= len(refused)
    assert_survived(flight)


def test_a_valve_that_sticks_open_is_named_and_lands_the_vehicle_until_a_person_lets_it_fly(fly):
    flight = fly(fault("stuck_open_valve", valve=0)).run(STOP_S + 8.0)
    assert "valve_stuck_open" in flight.faults()
    assert flight.modes()[-1] == "landed"
    assert flight.off_goal()[0][-1] < 0.2
    flight.request("fly")
    assert flight.run(6.0).modes()[-1] == "flying"


def test_a_valve_that_sticks_closed_is_named_and_the_others_hold_the_place(fly):
    lasting = fault("stuck_closed_valve", valve=0).replace(f"end_s = {END_S}", "end_s = 100.0")
    flight = fly(lasting).run(60.0)
    assert "valve_stuck_closed" in flight.faults()
    assert flight.modes(start_s=FAULT_S) == ["flying"]
    [shares] = flight.of(ValveShares)
    assert shares.open_ratio == (0.0, *[1.0] * 7)
    assert not any(demand.on_time_ms[0] for demand in flight.of(ValveDemand, start_s=30.0))
    assert max(flight.off_goal(start_s=30.0)[0]) < 0.015


def test_a_silent_bus_closes_the_valves_and_the_vehicle_lands_when_it_speaks_again(fly):
    end_s = FAULT_S + 0.9
    flight = fly(fault("silent_bus").replace(f"end_s = {END_S}", f"end_s = {end_s}")).run(STOP_S)
    assert not flight.of(ValveStatus, start_s=FAULT_S + 0.1, stop_s=end_s)
    first = flight.of(ValveStatus, start_s=end_s)[0]
    assert first.dead_man
    assert first.open_mask == 0
    assert first.armed
    assert first.floating
    assert flight.modes(start_s=FAULT_S)[:4] == ["flying", "lost", "landing", "resting"]
    assert_landed(flight, "can_silent")
    assert flight.run(8.0).modes()[-1] == "flying"


def test_a_bus_that_is_silent_for_more_than_a_second_lands_the_vehicle_without_the_station(fly):
    flight = fly(fault("silent_bus")).run(END_S + 0.1)
    first = flight.of(ValveStatus, start_s=END_S)[0]
    assert (first.floating, first.armed, first.open_mask) == (False, False, 0)
    # the bearings set down 0.2 s after their air is cut, and friction stops the rest
    truth = flight.of(ReferenceState, start_s=FAULT_S + 1.25, stop_s=END_S)
    assert max(np.hypot(*row.velocity_table_m_s) for row in truth) == 0.0
    assert truth[0].position_table_m == truth[-1].position_table_m
