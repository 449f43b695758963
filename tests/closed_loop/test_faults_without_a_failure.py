"""Faults that no single failure of the emulator provokes: found in closed loop by what really goes wrong."""

import json
import math

import pytest

from drivers.valve_bus.messages import Arm
from drivers.valve_bus.protocol import encode
from groundstation.declarations.node import Node
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.supervision.messages import Faults
from groundstation.parts.valves.messages import CanOut, ValveStatus

START_S = 6.0
TWO = "two_mock_ups_drawn"
LEAST_APART_M = 0.4
"""Of the middles of two hulls that touch."""


def failure(kind, span_s, vehicle="alpha", **parameters):
    inner = ", ".join(f"{name} = {float(value)}" for name, value in parameters.items())
    return (
        f'\n[[laboratory.failures]]\nkind = "{kind}"\nvehicle = "{vehicle}"\n'
        f"start_s = {START_S}\nend_s = {START_S + span_s}\nparameters = {{ {inner} }}\n"
    )


def first_s(flight, fault, vehicle="alpha"):
    """When a fault was first published, s after the failure began."""
    stamps = [row.stamp_ns for row in flight.of(Faults, vehicle) if fault in row.ids]
    assert stamps, f"{fault} never came; there were {flight.faults(vehicle)}"
    return stamps[0] * 1e-9 - START_S


@pytest.mark.provokes("edge_ahead")
def test_a_vehicle_that_a_hand_pushes_to_the_edge_brakes_before_it(fly):
    near = [("hold = { x_m = 0.2", "hold = { x_m = 1.5"), ("start_m = [0.0, 0.0]", "start_m = [1.5, 0.1]")]
    flight = fly(failure("pushed", 0.6, force_x_n=2.4), changes=near).run(12.0)
    assert first_s(flight, "edge_ahead") < 1.5
    assert "edge_unavoidable" not in flight.faults()
    assert max(row.position_table_m[0] for row in flight.of(ReferenceState)) < 1.8
    assert flight.modes(start_s=START_S)[:2] == ["flying", "braking"]
    assert flight.modes()[-1] != "landed"


@pytest.mark.parametrize(("newtons", "span_s"), [(1.6, 0.8), (1.6, 1.2), (2.4, 0.9)])
def test_a_hand_that_pushes_steadily_shifts_no_sensor(fly, newtons, span_s):
    flight = fly(failure("pushed", span_s, force_x_n=newtons, force_y_n=0.3)).run(START_S + 8.0)
    assert first_s(flight, "pushed") < 0.5
    assert not flight.faults() & {"imu_shifted", "valve_stuck_open", "valve_stuck_closed", "valve_weak"}
    assert flight.modes()[-1] in {"flying", "holding"}


@pytest.mark.provokes("imu_implausible")
def test_an_imu_that_turns_faster_than_it_can_read_is_not_believed_and_the_air_is_cut(fly):
    flight = fly(failure("pushed", 3.0, torque_nm=3.0)).run(START_S + 5.0)
    assert first_s(flight, "imu_implausible") < 3.0  # half a second after the gyro's end of range
    assert flight.modes()[-1] in {"landed", "resting"}
    assert not flight.of(ValveStatus)[-1].floating


@pytest.mark.provokes("edge_unavoidable")
def test_what_cannot_stop_before_the_edge_gets_its_air_cut(fly):
    flight = fly(failure("pushed", 1.5, force_x_n=6.0)).run(14.0)
    assert first_s(flight, "edge_unavoidable") < 2.0
    assert flight.modes()[-1] == "landed"
    assert not flight.of(ValveStatus)[-1].floating


@pytest.mark.provokes("vehicle_ahead")
def test_a_vehicle_that_is_pushed_to_its_neighbour_brakes_before_it(fly):
    near = [
        ("hold = { x_m = -0.5, y_m = 0.1", "hold = { x_m = -0.1, y_m = -0.1"),
        ("start_m = [-0.8, 0.0]", "start_m = [-0.1, -0.1]"),
        ("start_m = [0.8, 0.2]", "start_m = [0.6, -0.1]"),
    ]
    flight = fly(failure("pushed", 1.0, force_x_n=1.6), rig=TWO, changes=near).run(11.0)
    assert first_s(flight, "vehicle_ahead") < 1.5
    assert flight.modes(start_s=START_S)[:2] == ["flying", "braking"]
    assert apart_m(flight) > LEAST_APART_M


@pytest.mark.provokes("vehicle_unavoidable")
def test_what_cannot_stop_before_its_neighbour_gets_its_air_cut(fly):
    flight = fly(failure("pushed", 1.0, force_x_n=5.0), rig=TWO).run(14.0)
    assert first_s(flight, "vehicle_unavoidable") < 1.5
    assert flight.modes()[-1] == "landed"
    assert not flight.of(ValveStatus)[-1].floating


def apart_m(flight):
    """The least distance between the two by truth."""
    other = {row.stamp_ns: row.position_table_m for row in flight.of(ReferenceState, "beta")}
    return min(
        math.dist(row.position_table_m, other[row.stamp_ns])
        for row in flight.of(ReferenceState, "alpha")
        if row.stamp_ns in other
    )


@pytest.mark.parametrize("valve", [0, 5])
def test_a_coil_that_the_node_reports_lands_the_vehicle(fly, valve):
    flight = fly(failure("open_coil", 4.0, valve=valve)).run(20.0)
    assert first_s(flight, "coil_fault") < 0.5
    assert flight.modes()[-1] == "landed"
    flight.request("fly")
    assert flight.run(8.0).modes()[-1] == "flying"


@pytest.mark.provokes("position_uncertain")
def test_dead_reckoning_that_has_become_too_uncertain_lands(fly):
    noisy = [("acc_density_m_s2_rthz = 6.5e-5", "acc_density_m_s2_rthz = 2e-3")]
    flight = fly(failure("dead_sky", 40.0), changes=noisy).run(START_S + 22.0)
    assert 2.0 < first_s(flight, "position_uncertain") < 19.0
    assert flight.modes()[-1] in {"landed", "resting"}


@pytest.mark.provokes("leader_old")
def test_a_leader_that_falls_silent_makes_its_follower_hold(fly):
    follows = [
        (
            "hold = { x_m = 0.6, y_m = -0.1, heading_deg = 90.0 }",
            'hold = { x_m = 0.6, y_m = -0.1, heading_deg = 90.0 }\ncontrol = { controller = "follow", '
            'parameters = { leader = "alpha", distance_m = 1.0 } }',
        )
    ]
    flight = fly(failure("silent_imu", 10.0), rig=TWO, changes=follows).run(START_S + 4.0)
    assert first_s(flight, "leader_old", "beta") < 1.5
    assert flight.modes("beta")[-1] == "flying"  # it widens the distance, then holds its place
    assert flight.run(5.0).modes("beta")[-1] == "holding"
    assert flight.run(12.0).modes("beta")[-1] == "flying"


class Disarming(Node):
    """Somebody else on the bus who disarms the valve node again and again."""

    inputs = (ValveStatus,)
    outputs = (CanOut,)

    def receive(self, message, now_ns):
        return ()

    def tick(self, now_ns):
        if START_S * 1e9 <= now_ns < (START_S + 3.0) * 1e9:
            frame = encode(Arm(0, is_armed=False))
            yield CanOut(now_ns, "alpha", frame.arbitration_id, frame.data)


@pytest.mark.provokes("node_disobeys")
def test_a_node_that_is_disarmed_in_flight_loses_its_air(fly):
    flight = fly(extra_nodes=[Disarming("alpha", 10_000_000)]).run(START_S + 3.0)
    assert first_s(flight, "node_disobeys") < 0.5
    assert not flight.of(ValveStatus)[-1].floating


OFTEN = ("rate_hz = 1.5\ndelay_s = 0.6", "rate_hz = 15.0\ndelay_s = 0.015")


@pytest.mark.slow
@pytest.mark.provokes("filter_inconsistent")
@pytest.mark.parametrize("seed", [1, 2])
def test_a_table_that_is_wavier_than_the_filter_expects_is_said_and_it_flies_on(fly, seed):
    tilt = "tilt_rad = [0.0003, -0.0001]"
    wavy = (tilt, f"{tilt}\nwaviness_rad = 2e-4\nwaviness_length_m = 0.3")
    flight = fly(seed=seed, changes=[wavy, OFTEN]).run(START_S)
    flight.request("go_to", json.dumps({"x_m": 1.2, "y_m": 0.6, "heading_rad": 1.5}))
    flight.run(16.0)
    assert flight.faults() == {"filter_inconsistent"}
    assert "innovations beyond their covariance" in flight.of(Faults)[-1].details[0]
    assert flight.modes()[-1] == "flying"


def test_an_ordinary_table_is_none_that_the_filter_does_not_expect(fly):
    flight = fly(changes=[OFTEN]).run(START_S)
    flight.request("go_to", json.dumps({"x_m": 1.2, "y_m": 0.6, "heading_rad": 1.5}))
    assert flight.run(10.0).faults() == set()


@pytest.mark.provokes("fusion_lost")
def test_fixes_that_contradict_all_that_was_known_leave_it_lost_until_they_agree(fly):
    flight = fly(failure("wrong_fixes", 60.0, dx_m=0.5)).run(START_S + 12.0)
    lost_s = first_s(flight, "fusion_lost")
    contradicted_s = 0.6 + 3 / 1.5  # three in a row, 0.6 s late
    assert 0.6 < lost_s < contradicted_s + 1.0
    assert flight.modes(start_s=START_S)[:2] == ["flying", "holding"]
    assert "fusion_lost" not in flight.of(Faults)[-1].ids  # it began again where the fixes say


@pytest.mark.provokes("thrust_missing")
def test_two_dead_valves_that_leave_a_direction_without_thrust_land_it(fly):
    both = "".join(failure("stuck_closed_valve", 60.0, valve=valve) for valve in (2, 3))
    flight = fly(both).run(START_S + 8.0)
    missing_s = first_s(flight, "thrust_missing")
    assert missing_s - first_s(flight, "valve_stuck_closed") < 0.5
    row = next(row for row in flight.of(Faults) if "thrust_missing" in row.ids)
    assert "nothing acts along" in row.details[row.ids.index("thrust_missing")]
    assert "nothing left to brake with" in " ".join(row.details)
    assert flight.modes()[-1] == "landed"
    assert not flight.of(ValveStatus)[-1].floating
