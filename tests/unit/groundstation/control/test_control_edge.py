"""The keep-in region, the stopping distance and the brake law, up to flown stops."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.control.brake import BrakeConfig, brake_wrench
from groundstation.control.edge import EdgeVerdict, edge_outlook
from groundstation.control.keep_in import KeepIn, rectangle
from groundstation.control.state import ControlState
from groundstation.control.vehicle import VehicleModel, square_of_eight
from groundstation.control.wrench_envelope import WrenchEnvelope

VEHICLE = VehicleModel(11.0, 0.25, square_of_eight())
ENVELOPE = WrenchEnvelope(VEHICLE)
TABLE = rectangle((2.0, 1.0))


def moving(x, y, speed_x, speed_y):
    return ControlState((x, y), (speed_x, speed_y), 0.0, 0.0)


def test_distances_are_to_the_edges_in_the_order_of_the_corners():
    assert TABLE.edge_distances_m((0.9, 0.1)) == pytest.approx([0.6, 0.1, 0.4, 1.9])


@given(st.tuples(st.floats(-5, 5), st.floats(-5, 5)))
def test_the_nearest_point_inside_is_inside_and_no_corner_is_nearer(point):
    triangle = KeepIn(((0.0, 0.0), (2.0, 0.0), (0.5, 1.0)))
    nearest = triangle.nearest_inside(point)
    assert min(triangle.edge_distances_m(nearest)) >= -1e-9
    assert all(
        math.dist(nearest, point) <= math.dist(corner, point) + 1e-9 for corner in triangle.corners_table_m
    )
    if min(triangle.edge_distances_m(point)) >= 0.0:
        assert nearest == point


@pytest.mark.parametrize(
    ("corners", "words"),
    [
        (((0, 0), (1, 0)), "three corners"),
        (((0, 0), (0, 1), (1, 0)), "counter-clockwise"),
        (((0, 0), (2, 0), (0.5, 0.5), (0, 2)), "convex"),
    ],
)
def test_a_region_that_is_none_is_refused(corners, words):
    with pytest.raises(ValueError, match=words):
        KeepIn(corners)


def test_a_margin_wider_than_the_table_is_refused():
    with pytest.raises(ValueError, match="leaves nothing"):
        rectangle((2.0, 1.0), margin_m=0.5)


def test_stopping_from_a_fifth_of_a_metre_per_second_takes_what_mechanics_says():
    # v^2 / (2 a) = 0.04 / 0.05 = 0.8 m, plus the reaction's 0.02 m
    outlook = edge_outlook(moving(0.0, 0.0, 0.2, 0.0), TABLE, 0.025, reaction_s=0.1)
    assert outlook.stopping_distance_m == pytest.approx(0.82)
    assert outlook.room_m == pytest.approx(0.18)
    assert outlook.time_to_edge_s == pytest.approx(5.0)
    assert outlook.verdict is EdgeVerdict.CLEAR


@pytest.mark.parametrize(
    ("x", "verdict"), [(0.0, EdgeVerdict.CLEAR), (0.15, EdgeVerdict.BRAKE), (0.3, EdgeVerdict.TOO_LATE)]
)
def test_the_nearer_the_edge_the_sterner_the_verdict(x, verdict):
    assert edge_outlook(moving(x, 0.0, 0.2, 0.0), TABLE, 0.025, reaction_s=0.1).verdict is verdict


def test_a_mock_up_at_rest_or_on_its_way_back_is_left_alone():
    assert edge_outlook(moving(0.99, 0.0, 0.0, 0.0), TABLE, 0.03, reaction_s=0.1).verdict is EdgeVerdict.CLEAR
    back = edge_outlook(moving(1.05, 0.0, -0.02, 0.0), TABLE, 0.03, reaction_s=0.1)
    assert back.verdict is EdgeVerdict.CLEAR


def stop(state, dt_s=0.01, slope=(0.0, 0.0)):
    """Fly the brake law on a point mass until the end of a minute; returns states."""
    position, velocity = np.array(state.position_table_m), np.array(state.velocity_table_m_s)
    heading, rate = state.heading_rad, state.rate_rad_s
    flown = []
    for _ in range(round(60.0 / dt_s)):
        now = ControlState(tuple(position.tolist()), tuple(velocity.tolist()), heading, rate)
        flown.append(now)
        wrench = brake_wrench(now, BrakeConfig(), VEHICLE, ENVELOPE)
        assert ENVELOPE.contains(wrench)
        cosine, sine = math.cos(heading), math.sin(heading)
        force = np.array(((cosine, -sine), (sine, cosine))) @ wrench.force_body_n
        velocity = velocity + (force / VEHICLE.mass_kg + slope) * dt_s
        rate += wrench.torque_nm / VEHICLE.inertia_kg_m2 * dt_s
        position, heading = position + velocity * dt_s, heading + rate * dt_s
    return flown


@pytest.mark.parametrize("heading_rad", [0.0, 0.4, 2.0, -3.0])
def test_braking_ends_at_rest_in_the_predicted_distance(heading_rad):
    start = ControlState((-0.5, 0.0), (0.15, 0.0), heading_rad, math.radians(10.0))
    flown = stop(start)
    end = flown[-1]
    assert math.hypot(*end.velocity_table_m_s) < 0.0025
    assert abs(end.rate_rad_s) < math.radians(1.1)
    # in the weakest direction 0.04 m/s^2; a tenth is left for the turn that is braken at the same time,
    # and the last millimetres per second fade out proportionally
    coasting_m = 60.0 * 0.0025
    predicted_m = edge_outlook(start, TABLE, 0.036, reaction_s=0.0).stopping_distance_m
    way_m = math.dist(end.position_table_m, start.position_table_m)
    assert way_m <= predicted_m + coasting_m


def test_braking_never_speeds_up():
    flown = stop(ControlState((0.0, 0.0), (0.1, -0.2), 1.0, 0.3))
    speeds = [math.hypot(*state.velocity_table_m_s) for state in flown]
    assert all(after <= before + 1e-12 for before, after in itertools.pairwise(speeds))


def test_on_a_tilted_table_braking_creeps_at_a_few_millimetres_per_second():
    end = stop(ControlState((0.0, 0.0), (0.1, 0.0), 0.0, 0.0), slope=(0.003, 0.0))[-1]
    # 0.003 / 2 per second above the rest speed of 2 mm/s
    assert math.hypot(*end.velocity_table_m_s) == pytest.approx(0.0035, abs=1e-4)


def test_noise_at_rest_burns_nothing():
    wrench = brake_wrench(moving(0.0, 0.0, 0.0014, 0.0014), BrakeConfig(), VEHICLE, ENVELOPE)
    assert wrench.force_body_n == (0.0, 0.0)
    assert wrench.torque_nm == 0.0


anything = st.floats(allow_nan=False, allow_infinity=False)


@given(
    st.builds(ControlState, st.tuples(anything, anything), st.tuples(anything, anything), anything, anything)
)
def test_the_brake_is_within_the_valves_whatever_the_state(state):
    wrench = brake_wrench(state, BrakeConfig(), VEHICLE, ENVELOPE)
    assert ENVELOPE.contains(wrench)
    assert wrench.torque_nm * state.rate_rad_s <= 0.0
