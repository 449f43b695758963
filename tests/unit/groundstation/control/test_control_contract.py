"""What every row of the table of controllers must keep, found by the table."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from groundstation.control.controllers import controllers, make_controller
from groundstation.control.state import BodyWrench, ControlState, Goal
from groundstation.control.vehicle import VehicleModel, square_of_eight
from groundstation.control.wrench_envelope import WrenchEnvelope

VEHICLE = VehicleModel(11.0, 0.25, square_of_eight())
ENVELOPE = WrenchEnvelope(VEHICLE)
rows = pytest.mark.parametrize("name", controllers())

anything = st.floats(allow_nan=False, allow_infinity=False)
pairs = st.tuples(anything, anything)
wild_states = st.builds(ControlState, pairs, pairs, anything, anything, pairs)
wild_goals = st.builds(Goal, pairs, anything, pairs, anything, pairs, anything)
wild_wrenches = st.none() | st.builds(BodyWrench, pairs, anything)
spans = st.floats(1e-6, 1e6)


def build(name):
    return make_controller(name, controllers()[name].example, VEHICLE)


@rows
@given(inputs=st.lists(st.tuples(wild_states, wild_goals, spans, wild_wrenches, wild_states), max_size=5))
@settings(max_examples=40)
def test_any_finite_input_gives_a_wrench_that_the_valves_can_make_and_the_same_twice(name, inputs):
    first, second = build(name), build(name)
    for state, goal, dt_s, applied, other in inputs:
        neighbours = {"leader": other}
        wrench = first.update(state, goal, dt_s, applied=applied, neighbours=neighbours)
        assert math.isfinite(wrench.torque_nm)
        assert all(map(math.isfinite, wrench.force_body_n))
        assert ENVELOPE.contains(wrench)
        assert second.update(state, goal, dt_s, applied=applied, neighbours=neighbours) == wrench


@pytest.mark.parametrize("name", [name for name, row in controllers().items() if not row.has_program])
@given(
    place=st.tuples(st.floats(-2, 2), st.floats(-2, 2)),
    heading_rad=st.floats(-math.pi, math.pi),
    turns=st.integers(-3, 3),
)
@settings(max_examples=40)
def test_at_rest_at_the_goal_nothing_pushes(name, place, heading_rad, turns):
    controller = build(name)
    goal = Goal(place, heading_rad)
    state = ControlState(place, (0.0, 0.0), heading_rad + turns * math.tau, 0.0)
    # 0.6 m ahead of a follower that keeps 0.6 m behind
    ahead = (place[0] + 0.6 * math.cos(heading_rad), place[1] + 0.6 * math.sin(heading_rad))
    leader = ControlState(ahead, (0.0, 0.0), heading_rad, 0.0)
    for _ in range(3):
        wrench = controller.update(state, goal, 0.02, neighbours={"leader": leader})
        assert wrench.force_body_n == pytest.approx((0.0, 0.0), abs=1e-9)
        assert wrench.torque_nm == pytest.approx(0.0, abs=1e-9)


@rows
def test_a_reset_controller_is_a_new_one(name):
    state, goal = ControlState((0.1, 0.2), (0.01, 0.0), 0.4, 0.01), Goal((0.0, 0.0), 0.0)
    used, new = build(name), build(name)
    for _ in range(20):
        used.update(state, goal, 0.02)
    used.reset()
    assert [used.update(state, goal, 0.02) for _ in range(5)] == [
        new.update(state, goal, 0.02) for _ in range(5)
    ]


@rows
@pytest.mark.parametrize("dt_s", [0.0, -0.1, math.nan, math.inf])
def test_time_that_does_not_pass_is_refused(name, dt_s):
    state = ControlState((0.0, 0.0), (0.0, 0.0), 0.0, 0.0)
    with pytest.raises(ValueError, match="dt_s must be above 0"):
        build(name).update(state, Goal((0.0, 0.0), 0.0), dt_s)


@rows
def test_a_misspelt_setting_is_named(name):
    with pytest.raises(ValidationError, match="speeed"):
        make_controller(name, {**controllers()[name].example, "speeed": 1.0}, VEHICLE)


def test_an_unknown_controller_is_answered_with_the_known_ones():
    with pytest.raises(
        ValueError,
        match=r"'hover'; there are dock, follow, formation, go_to, path, station, trajectory, tumble, turn",
    ):
        make_controller("hover", {}, VEHICLE)
