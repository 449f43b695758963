"""Faults that no single failure of the emulator provokes: found in closed loop by what really goes wrong."""

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


def test_an_imu_that_turns_faster_than_it_can_read_is_not_believed_and_the_air_is_cut(fly):
    flight = fly(failure("pushed", 3.0, torque_nm=3.0)).run(START_S + 5.0)
    assert first_s(flight, "imu_implausible") < 3.0  # half a second after the gyro's end of range
    assert flight.modes()[-1] in {"landed", "resting"}
    assert not flight.of(ValveStatus)[-1].floating


def test_what_cannot_stop_before_the_edge_gets_its_air_cut(fly):
    flight = fly(failure("pushed", 1.5, force_x_n=6.0)).run(14.0)
    assert first_s(flight, "edge_unavoidable") < 2.0
    assert flight.modes()[-1] == "landed"
    assert not flight.of(ValveStatus)[-1].floating


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


def test_dead_reckoning_that_has_become_too_uncertain_lands(fly):
    noisy = [("acc_density_m_s2_rthz = 6.5e-5", "acc_density_m_s2_rthz = 2e-3")]
    flight = fly(failure("dead_sky", 40.0), changes=noisy).run(START_S + 22.0)
    assert 2.0 < first_s(flight, "position_uncertain") < 19.0
    assert flight.modes()[-1] in {"landed", "resting"}


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


def test_a_node_that_is_disarmed_in_flight_loses_its_air(fly):
    flight = fly(extra_nodes=[Disarming("alpha", 10_000_000)]).run(START_S + 3.0)
    assert first_s(flight, "node_disobeys") < 0.5
    assert not flight.of(ValveStatus)[-1].floating
