"""Angles, vectors and the refusal of what is not a number."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.control.averaging import RateMean
from groundstation.control.state import BodyWrench, ControlState, Goal, limit_length, rotate

finite = st.floats(-1e6, 1e6)


@given(st.tuples(finite, finite), st.floats(-10, 10))
def test_turning_there_and_back_changes_nothing(vector, angle_rad):
    assert rotate(rotate(vector, angle_rad), -angle_rad) == pytest.approx(vector, abs=1e-8)


def test_body_x_of_a_mock_up_that_looks_along_table_y_is_table_y():
    assert rotate((1.0, 0.0), math.pi / 2) == pytest.approx((0.0, 1.0))


@given(st.tuples(finite, finite), st.floats(1e-6, 100.0))
def test_a_limited_vector_is_short_enough_and_keeps_its_direction(vector, limit):
    limited = limit_length(vector, limit)
    assert math.hypot(*limited) <= limit * (1 + 1e-12)
    assert limited[0] * vector[1] == pytest.approx(limited[1] * vector[0], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_nothing_that_is_not_a_number_enters_or_leaves_a_controller(bad):
    with pytest.raises(ValueError, match="state must be finite"):
        ControlState((0.0, 0.0), (bad, 0.0), 0.0, 0.0)
    with pytest.raises(ValueError, match="goal must be finite"):
        Goal((0.0, bad), 0.0)
    with pytest.raises(ValueError, match="wrench must be finite"):
        BodyWrench((0.0, 0.0), bad)


def test_the_mean_rate_goes_with_the_newest_pose():
    mean = RateMean()
    assert mean.take() is None
    for count in range(1, 4):
        mean.add(ControlState((float(count), 0.0), (0.0, 0.0), 0.0, 0.1 * count))
    taken = mean.take()
    assert taken.position_table_m == (3.0, 0.0)
    assert taken.rate_rad_s == pytest.approx(0.2)
    # nothing new: the last state as it came
    assert mean.take().rate_rad_s == pytest.approx(0.3)


def test_a_late_state_is_carried_to_the_present_by_coasting():
    late = ControlState((1.0, 2.0), (0.1, -0.2), 0.5, 0.3)
    now = late.carried(0.5)
    assert now.position_table_m == pytest.approx((1.05, 1.9))
    assert now.heading_rad == pytest.approx(0.65)
    assert now.velocity_table_m_s == late.velocity_table_m_s


def test_the_largest_numbers_are_numbers():
    ControlState((1.7e308, 1.7e308), (-1.7e308, 1.7e308), 1.7e308, 1.7e308)
