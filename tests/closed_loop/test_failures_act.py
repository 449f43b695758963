"""Failures that no other closed-loop test injects: each reaches the station as what it is."""

import numpy as np
import pytest

from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.imu.messages import Imu
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.stars.messages import StarFix
from groundstation.parts.valves.messages import CanIn, ValveStatus

START_S, END_S = 4.0, 6.0


def failure(kind, **parameters):
    inner = ", ".join(f"{name} = {float(value)}" for name, value in parameters.items())
    return (
        f'\n[[laboratory.failures]]\nkind = "{kind}"\nvehicle = "alpha"\n'
        f"start_s = {START_S}\nend_s = {END_S}\nparameters = {{ {inner} }}\n"
    )


@pytest.mark.parametrize(
    ("kind", "parameters"),
    [
        ("weak_valve", {"valve": 0, "fraction": 0.0}),
        ("pulsing_valve", {"valve": 0, "period_s": 1.0, "on_s": 0.5}),
        ("low_tank", {"tank_bar": 0.5}),
        ("low_battery", {"battery_v": 8.0}),
        ("pushed", {"force_x_n": 0.5}),
        ("shifted_imu", {"gyro_deg_s": 1.0, "acc_x_mg": 5.0}),
    ],
)
def test_what_pushes_or_misleads_moves_the_mock_up_otherwise(fly, kind, parameters):
    ill, healthy = fly(failure(kind, **parameters)).run(END_S), fly().run(END_S)
    places, others = (
        np.array([row.position_table_m for row in flight.of(ReferenceState)]) for flight in (ill, healthy)
    )
    apart_m = np.hypot(*(places - others).T)
    before = sum(row.stamp_ns < START_S * 1e9 for row in ill.of(ReferenceState))
    assert apart_m[:before].max() == 0.0
    assert apart_m.max() > 0.001


def test_a_low_battery_is_reported(fly):
    flight = fly(failure("low_battery")).run(END_S + 0.1)
    assert {row.faults for row in flight.of(ValveStatus, stop_s=START_S)} == {0}
    assert {row.faults for row in flight.of(ValveStatus, start_s=START_S + 0.03, stop_s=END_S)} == {1}


def test_a_silent_block_gives_no_samples(fly):
    flight = fly(failure("silent_imu")).run(END_S + 0.5)
    assert not flight.of(Imu, start_s=START_S + 0.05, stop_s=END_S)
    assert flight.of(Imu, start_s=END_S + 0.05)


def test_a_clock_that_jumps_is_counted(fly):
    flight = fly(failure("clock_jump", jump_ms=20000)).run(END_S + 1.0)
    assert flight.counters("alpha/imu_reader")["discontinuities"] >= 2


def test_a_flood_of_foreign_frames_reaches_the_station_which_flies_on(fly):
    flight = fly(failure("flooded_bus", rate_hz=1000)).run(END_S)
    assert len(flight.of(CanIn, vehicle="", start_s=START_S)) > 1500
    assert len(flight.of(ValveStatus, start_s=START_S)) > 95
    assert all(row.status == "flying" for row in flight.of(VehicleState, start_s=START_S))


def test_a_slow_camera_gives_fewer_fixes(fly):
    flight = fly(failure("slow_camera", keep_one_in=3, delay_s=0.0)).run(END_S)
    healthy = fly().run(END_S)
    few, many = (len(row.of(StarFix, start_s=START_S)) for row in (flight, healthy))
    assert 0 < few <= many / 2


def test_wrong_fixes_are_off_by_what_was_injected(fly):
    flight = fly(failure("wrong_fixes", dx_m=0.1)).run(END_S)
    fixes = [row for row in flight.of(StarFix) if START_S * 1e9 < row.stamp_ns < END_S * 1e9]
    truth = {row.stamp_ns: row.position_table_m for row in flight.of(ReferenceState)}
    assert fixes
    for fix in fixes:
        nearest = truth[min(truth, key=lambda stamp_ns, fix=fix: abs(stamp_ns - fix.stamp_ns))]
        assert np.subtract((fix.x_m, fix.y_m), nearest) == pytest.approx((0.1, 0.0), abs=0.008)
