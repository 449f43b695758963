"""The published formulas of the IMU's integration against values worked out by hand."""

import math

import numpy as np
import pytest

from groundstation.fusion.published_steps import (
    MAX_ACC_M_S2,
    MAX_RATE_RAD_S,
    Moving,
    in_table_axes,
    is_anomalous,
    median_zeros_of_rest,
    stepped,
    stepped_exactly,
    travel_sums,
    zeros_of_rest,
)
from groundstation.fusion.star_states import StarPose, StarStates


def test_zeros_are_plain_means_wild_samples_included():
    rate, ax, ay = np.array([0.1, 0.2, 0.6]), np.array([0.0, 0.0, 3.0]), np.array([-1.0, -2.0, -6.0])
    assert zeros_of_rest(rate, ax, ay) == pytest.approx((0.3, 1.0, -3.0))


def test_the_rotation_is_the_printed_one():
    # aX = ax cos + ay sin, aY = ay cos - ax sin, at 30 deg
    ax, ay = in_table_axes(2.0, 1.0, math.radians(30.0))
    assert ax == pytest.approx(2.0 * math.sqrt(0.75) + 0.5)
    assert ay == pytest.approx(math.sqrt(0.75) - 1.0)


def test_the_angle_of_the_rotation_is_minus_the_heading():
    # a push along body x of a body that faces table +y pushes along table +y
    after = stepped(Moving(0.5 * math.pi, 0.0, 0.0, 0.0, 0.0), 0.0, (0.1, 0.0), 1.0)
    assert after.vx_m_s == pytest.approx(0.0, abs=1e-15)
    assert after.vy_m_s == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("table", "rate", "either", "both"),
    [
        ((0.5, -0.5), math.radians(50.0), False, False),  # at the limits
        ((0.5001, 0.0), 0.0, True, False),
        ((0.0, -0.5001), 0.0, True, False),
        ((0.0, 0.0), -math.radians(50.01), True, False),
        ((0.0, 0.6), math.radians(51.0), True, True),
        ((math.nan, 0.0), 0.0, True, False),
    ],
)
def test_a_sample_beyond_the_limits_is_anomalous(table, rate, either, both):
    assert (0.5, math.radians(50.0)) == (MAX_ACC_M_S2, MAX_RATE_RAD_S)
    assert is_anomalous(table, rate) is either
    assert is_anomalous(table, rate, needs_both=True) is both


def test_a_step_is_the_printed_one():
    # heading 0.2 + 0.5 * 0.4 = 0.4 first, then the rotation, the velocity, the position with the new velocity
    before = Moving(0.2, 0.03, -0.01, 1.0, 2.0)
    c, s = math.cos(0.4), math.sin(0.4)
    gx, gy = 0.3 * c - 0.1 * s, 0.1 * c + 0.3 * s
    vx, vy = 0.03 + gx * 0.4, -0.01 + gy * 0.4
    expected = (0.4, vx, vy, 1.0 + vx * 0.4 + gx / 2 * 0.16, 2.0 + vy * 0.4 + gy / 2 * 0.16)
    assert stepped(before, 0.5, (0.3, 0.1), 0.4) == pytest.approx(expected)


def test_a_sample_moves_the_position_by_three_halves():
    at_rest = Moving(0.0, 0.0, 0.0, 0.0, 0.0)
    assert stepped(at_rest, 0.0, (0.2, 0.0), 0.5).x_m == pytest.approx(1.5 * 0.2 * 0.25)
    assert stepped_exactly(at_rest, 0.0, (0.2, 0.0), 0.5).x_m == pytest.approx(0.5 * 0.2 * 0.25)


def test_an_exact_step_takes_the_angle_of_the_middle():
    after = stepped_exactly(Moving(0.0, 0.0, 0.0, 0.0, 0.0), math.pi / 2, (0.1, 0.0), 1.0)
    assert (after.vx_m_s, after.vy_m_s) == pytest.approx((0.1 * math.sqrt(0.5), 0.1 * math.sqrt(0.5)))
    assert after.heading_rad == pytest.approx(math.pi / 2)


def test_gates_look_at_the_tables_axes_and_pause_the_integration():
    facing = Moving(math.radians(45.0), 0.0, 0.0, 0.0, 0.0)
    # 0.4 along both body axes: nothing beyond 0.5 in the body, 0.566 along table y
    assert stepped(facing, 0.0, (0.4, 0.4), 0.01) is None
    assert stepped(facing._replace(heading_rad=0.0), 0.0, (0.4, 0.4), 0.01) is not None
    # 0.6 along one body axis is 0.424 along both table axes
    assert stepped(facing, 0.0, (0.6, 0.0), 0.01) is not None


def test_the_sums_are_those_printed():
    a, d = np.array([0.2, -0.1, 0.4]), np.array([0.5, 0.25, 1.0])
    s1 = 1.5 * 0.2 * 0.25
    s2 = 0.2 * 0.5 * 0.25 + 1.5 * (0.2 * 0.25 - 0.1 * 0.0625)
    s3 = 0.2 * 0.5 * (0.25 + 1.0) - 0.1 * 0.25 * 1.0 + 1.5 * (0.2 * 0.25 - 0.1 * 0.0625 + 0.4 * 1.0)
    assert travel_sums(a, d) == pytest.approx([s1, s2, s3])
    assert travel_sums(np.stack([a, 2.0 * a]), d)[1] == pytest.approx([2 * s1, 2 * s2, 2 * s3])


def test_the_sums_are_what_the_steps_add_up_to():
    rng = np.random.default_rng(1)
    a, d = rng.normal(0.0, 0.1, 50), rng.uniform(0.005, 0.02, 50)
    state = Moving(0.0, 0.03, 0.0, 1.0, 0.0)
    for force, step in zip(a, d, strict=True):
        state = stepped(state, 0.0, (force, 0.0), step)
    assert state.x_m == pytest.approx(1.0 + 0.03 * d.sum() + travel_sums(a, d)[-1])


def test_with_even_steps_the_printed_position_is_ahead_by_step_times_change_of_velocity():
    state, exact = (Moving(0.0, 0.0, 0.0, 0.0, 0.0),) * 2
    for _ in range(100):
        state = stepped(state, 0.0, (0.1, 0.0), 0.01)
        exact = stepped_exactly(exact, 0.0, (0.1, 0.0), 0.01)
    assert state.vx_m_s == pytest.approx(0.1)
    assert state.x_m - exact.x_m == pytest.approx(0.01 * 0.1)  # a millimetre


def test_medians_instead_are_deaf_to_a_wild_sample():
    rate, ax, ay = np.array([0.1, 0.2, 0.6]), np.array([0.0, 0.1, 3.0]), np.array([-1.0, -2.0, -6.0])
    assert median_zeros_of_rest(rate, ax, ay) == (0.2, 0.1, -2.0)


def test_star_velocities_are_differences_of_two_fixes():
    stars = StarStates()
    assert stars.state() is None
    assert stars.standing() is None
    stars.add(StarPose(1.0, 0.5, -0.2, 3.1))
    assert stars.state() == (Moving(3.1, 0.0, 0.0, 0.5, -0.2), 0.0)
    stars.add(StarPose(1.5, 0.6, -0.3, -3.1))  # over the seam: 6.2 rad back is 0.083 on
    state, rate = stars.state()
    turned = 2.0 * math.pi - 6.2
    assert state == pytest.approx((3.1 + turned, 0.2, -0.2, 0.6, -0.3))
    assert rate == pytest.approx(turned / 0.5)
    assert stars.standing() == pytest.approx((3.1 + turned, 0.0, 0.0, 0.6, -0.3))
