"""Gains, observer and reference: the parts of the laws against closed solutions."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import solve_continuous_are

from groundstation.control.gains import lqr_gains
from groundstation.control.observer import DisturbanceObserver
from groundstation.control.reference import MotionLimits, PointReference

LIMITS = MotionLimits(0.10, 0.02)
DT_S = 0.02


@given(st.floats(0.001, 1.0), st.floats(0.001, 1.0), st.floats(0.001, 1.0))
def test_gains_solve_the_riccati_equation(error, acceleration, speed):
    """Authority: scipy's Riccati solver."""
    dynamics, inputs = np.array(((0.0, 1.0), (0.0, 0.0))), np.array(((0.0,), (1.0,)))
    weights, price = np.diag((error**-2, speed**-2)), np.array(((acceleration**-2,),))
    cost = solve_continuous_are(dynamics, inputs, weights, price)
    gain = (inputs.T @ cost / price).ravel()
    gains = lqr_gains(error, acceleration, speed)
    assert (gains.stiffness_per_s2, gains.damping_per_s) == pytest.approx(tuple(gain), rel=1e-5)


@pytest.mark.parametrize("bad", [(0.0, 1.0), (1.0, -1.0), (math.nan, 1.0)])
def test_weights_that_are_not_positive_are_refused(bad):
    with pytest.raises(ValueError, match="positive weights"):
        lqr_gains(*bad)


def observe(disturbance, push, seconds, noise=0.0, limit=0.01):
    rng = np.random.default_rng(3)
    observer, speed = DisturbanceObserver(0.6, limit), 0.0
    for count in range(round(seconds / DT_S)):
        own = push(count * DT_S)
        speed += (own + disturbance) * DT_S
        observer.update(speed + noise * rng.normal(), own, DT_S)
    return observer, speed


def test_the_observer_finds_the_slope_while_the_valves_fire():
    observer, speed = observe(0.003, lambda time_s: 0.02 * math.sin(3.0 * time_s), 30.0)
    assert observer.disturbance == pytest.approx(0.003, rel=1e-3)
    assert observer.speed == pytest.approx(speed, abs=1e-5)


def test_the_observer_averages_noise_away():
    observer, speed = observe(0.003, lambda _: -0.003, 60.0, noise=0.01)
    # white noise through the equal-pole observer: std about 1.1 sqrt(w dt) of the input
    assert observer.speed == pytest.approx(speed, abs=3 * 0.01 * 1.1 * math.sqrt(0.6 * DT_S))


def test_the_observer_believes_in_no_cliff():
    assert observe(1.0, lambda _: 0.0, 5.0)[0].disturbance == 0.01


def travel(reference, goal, goal_velocity=(0.0, 0.0), seconds=60.0):
    rows = []
    for count in range(round(seconds / DT_S)):
        now_s = (count + 1) * DT_S
        target = (goal[0] + goal_velocity[0] * now_s, goal[1] + goal_velocity[1] * now_s)
        before = reference.velocity
        reference.advance(target, goal_velocity, DT_S)
        change = math.dist(before, reference.velocity)
        rows.append((now_s, *reference.position, *reference.velocity, change / DT_S, reference.is_at_goal))
        if reference.is_at_goal:
            break
    return np.array(rows)


@pytest.mark.parametrize("distance_m", [0.01, 0.2, 1.0, 3.0])
def test_from_rest_the_way_takes_hardly_longer_than_the_time_optimal_trapezoid(distance_m):
    rows = travel(PointReference(LIMITS, (0.0, 0.0), (0.0, 0.0)), (0.6 * distance_m, 0.8 * distance_m))
    ramp_m = LIMITS.speed**2 / LIMITS.acceleration
    if distance_m > ramp_m:
        optimal_s = 2 * LIMITS.speed / LIMITS.acceleration + (distance_m - ramp_m) / LIMITS.speed
    else:
        optimal_s = 2 * math.sqrt(distance_m / LIMITS.acceleration)
    assert rows[-1, -1] == 1
    assert optimal_s - 2 * DT_S <= rows[-1, 0] <= 1.15 * optimal_s + 5 * DT_S
    # straight: no component across the way
    assert np.abs(rows[:, 1] * 0.8 - rows[:, 2] * 0.6).max() < 1e-9


@given(
    st.tuples(st.floats(-2, 2), st.floats(-2, 2)),
    st.tuples(st.floats(-0.07, 0.07), st.floats(-0.07, 0.07)),
)
def test_any_start_keeps_the_limits_and_arrives(goal, velocity):
    reference = PointReference(LIMITS, (0.0, 0.0), velocity)
    rows = travel(reference, goal, seconds=120.0)
    assert rows[-1, -1] == 1
    assert np.hypot(rows[:, 3], rows[:, 4]).max() <= LIMITS.speed * (1 + 1e-9)
    assert rows[:, 5].max() <= LIMITS.acceleration * (1 + 1e-9)


def test_from_rest_the_way_never_overshoots():
    rows = travel(PointReference(LIMITS, (0.0, 0.0), (0.0, 0.0)), (0.5, 0.0))
    assert rows[:, 1].max() <= 0.5 + 1e-9


def test_a_goal_that_moves_steadily_is_met_and_then_followed_without_lag():
    reference = PointReference(LIMITS, (0.0, 0.0), (0.0, 0.0))
    rows = travel(reference, (0.3, 0.0), (0.0, 0.03))
    assert rows[-1, -1] == 1
    for count in range(len(rows), len(rows) + 100):
        target = (0.3, 0.03 * (count + 1) * DT_S)
        reference.advance(target, (0.0, 0.03), DT_S)
        assert reference.position == pytest.approx(target, abs=1e-9)


def test_a_reached_goal_that_jumps_a_little_is_followed_at_once_and_a_lot_by_a_way():
    reference = PointReference(MotionLimits(0.10, 0.02, capture=0.02), (0.0, 0.0), (0.0, 0.0))
    for goal, at_once in (((0.0, 0.0), True), ((0.015, 0.0), True), ((0.3, 0.0), False)):
        reference.advance(goal, (0.0, 0.0), DT_S)
        assert reference.is_at_goal is at_once
