"""Where a guided calibration sends a vehicle: its goals excite every axis and stay on the table."""

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from calibration.manoeuvres import inside, push, turn
from groundstation.control.keep_in import KeepIn

HOME = (0.4, -0.2, 0.7)
TABLE = KeepIn(((-1.8, -1.3), (1.8, -1.3), (1.8, 1.3), (-1.8, 1.3)))


def steps(goals, place):
    return [after[place] - before[place] for before, after in itertools.pairwise(goals)]


def test_turns_stay_on_the_spot_and_go_a_whole_turn_each_way():
    goals = [HOME, *[turn(number, HOME) for number in range(12)]]
    assert {goal[:2] for goal in goals} == {HOME[:2]}
    turned = steps(goals, 2)
    third = math.radians(120.0)
    assert turned == pytest.approx(([third] * 3 + [-third] * 3) * 2)
    assert max(map(abs, turned)) < math.pi, "the shorter way round would be the other one"
    assert sum(turned) == pytest.approx(0.0)


def test_pushes_excite_both_axes_in_every_quarter_of_heading_and_return():
    goals = [push(number, HOME) for number in range(8)]
    assert goals[:4] == goals[4:]
    for axis in (0, 1):
        moved = steps([*goals[:4], goals[0]], axis)
        assert min(moved) < -0.2
        assert max(moved) > 0.2
    headings = [goal[2] - HOME[2] for goal in goals[:4]]
    assert [round(math.degrees(heading)) % 360 for heading in headings] == [0, 90, 180, 270]


@given(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), st.floats(-4.0, 4.0))
def test_goals_lie_within_the_part_that_vehicles_keep_to(x_m, y_m, heading_rad):
    goal = inside((x_m, y_m, heading_rad), TABLE)
    assert min(TABLE.edge_distances_m(goal[:2])) >= 0.0
    assert goal[2] == heading_rad
    if min(TABLE.edge_distances_m((x_m, y_m))) >= 0.0:
        assert goal[:2] == (x_m, y_m)
    else:  # no farther than rounding needs
        nearest = TABLE.nearest_inside((x_m, y_m))
        assert math.dist(goal[:2], nearest) <= 0.01 * math.hypot(1.8, 1.3) + 1e-9
