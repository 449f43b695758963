"""The safety filter: its condition against a derivative by steps; whatever is wanted, nothing is hit."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.control.keep_in import rectangle
from groundstation.control.safety_filter import (
    Disc,
    SafetyFilter,
    SafetyFilterConfig,
    body_force,
    table_acceleration,
)
from groundstation.control.state import BodyWrench, ControlState

TABLE = rectangle((4.0, 3.0), margin_m=0.2)
CONFIG = SafetyFilterConfig()
BRAKING_M_S2 = 0.03
REACH_M = 0.42


def state(x=0.0, y=0.0, vx=0.0, vy=0.0, slope=(0.0, 0.0)):
    return ControlState((x, y), (vx, vy), 0.3, 0.0, slope)


def make(**changes):
    return SafetyFilter(CONFIG.model_copy(update=changes), TABLE)


def test_far_from_everything_what_is_wanted_is_not_changed():
    found = make().filtered((0.01, -0.02), state(vx=0.02), [], BRAKING_M_S2)
    assert found == ((0.01, -0.02), (), False)


def test_a_push_over_the_edge_is_taken_back_and_the_edge_is_named():
    found = make().filtered((0.03, 0.01), state(x=1.79), [], BRAKING_M_S2)
    assert found.limited_by == ("edge",)
    assert found.acceleration_table_m_s2[0] < 0.012
    assert found.acceleration_table_m_s2[1] == pytest.approx(0.01)
    assert not found.must_brake


def test_what_takes_it_away_is_never_changed():
    beside = Disc("beta", (0.43, 0.0), (0.0, 0.0), REACH_M, 1.0)
    assert make().filtered((-0.02, 0.0), state(), [beside], BRAKING_M_S2).limited_by == ()
    assert make().filtered((0.02, 0.0), state(), [beside], BRAKING_M_S2).limited_by == ("beta",)


def test_too_fast_to_be_held_by_less_it_brakes():
    found = make().filtered((0.03, 0.0), state(x=1.3, vx=0.25), [], BRAKING_M_S2)
    assert found.must_brake
    assert found.limited_by == ("edge",)


def test_two_on_one_spot_are_no_crash_of_the_filter():
    found = make().filtered((0.0, 0.0), state(), [Disc("beta", (0.0, 0.0), (0.0, 0.0), REACH_M, 1.0)], 0.0)
    assert found.must_brake or all(map(math.isfinite, found.acceleration_table_m_s2))


def room(position, velocity, disc, braking_m_s2, config=CONFIG):
    """h of the module's docstring, written again."""
    dx, dy = disc.position_table_m[0] - position[0], disc.position_table_m[1] - position[1]
    apart = math.hypot(dx, dy)
    towards = np.array((dx, dy)) / apart
    speed = math.hypot(*velocity)
    left = apart - disc.reach_m
    left -= max(0.0, float(towards @ velocity)) * (
        config.reaction_s + config.reserve_s + speed / (2.0 * braking_m_s2)
    )
    return left


@pytest.mark.parametrize("velocity", [(0.05, 0.0), (0.04, 0.03), (0.06, -0.02)])
def test_the_condition_is_the_derivative_of_the_room(velocity):
    """At the edge of what is allowed dh/dt = -k h, but for the turning of the line: on the safe side."""
    disc = Disc("rock", (0.46, 0.0), (0.0, 0.0), 0.3, 1.0)
    filter_ = make(share_of_braking=1.0)
    wanted = (0.029, 0.0)
    found = filter_.filtered(wanted, state(vx=velocity[0], vy=velocity[1]), [disc], BRAKING_M_S2)
    assert found.limited_by == ("rock",)
    step_s = 1e-5
    u = np.array(found.acceleration_table_m_s2)
    v = np.array(velocity)
    after = room(v * step_s, v + u * step_s, disc, BRAKING_M_S2)
    now = room((0.0, 0.0), v, disc, BRAKING_M_S2)
    falling = (after - now) / step_s
    across = velocity[1] ** 2 / 0.46
    stopping_s = CONFIG.reaction_s + CONFIG.reserve_s + math.hypot(*velocity) / (2.0 * BRAKING_M_S2)
    assert falling == pytest.approx(-CONFIG.gain_per_s * now + across * stopping_s, abs=2e-4)


def test_a_slope_is_counted():
    level = make().filtered((0.03, 0.0), state(x=1.74, vx=0.03), [], BRAKING_M_S2)
    downhill = make().filtered((0.03, 0.0), state(x=1.74, vx=0.03, slope=(0.004, 0.0)), [], BRAKING_M_S2)
    change = level.acceleration_table_m_s2[0] - downhill.acceleration_table_m_s2[0]
    assert change == pytest.approx(0.004)


def fly(filter_, bodies, wants, rng, *, steps=400, period_s=0.1, late_s=0.1):
    """Bodies with double integrators; commands act late and are held; yields positions after each step."""
    acting = [np.zeros(2) for _ in bodies]
    for step in range(steps):
        states = list(bodies)
        for index, body in enumerate(states):
            others = [
                Disc(str(k), each.position_table_m, each.velocity_table_m_s, REACH_M, 0.5)
                for k, each in enumerate(states)
                if k != index
            ]
            wanted = wants(step, index, rng)
            found = filter_.filtered(tuple(wanted), body, others, BRAKING_M_S2)
            if found.must_brake:
                v = np.array(body.velocity_table_m_s)
                speed = np.linalg.norm(v)
                u = -v / max(speed, 1e-9) * min(BRAKING_M_S2, speed / period_s)
            else:
                u = np.array(found.acceleration_table_m_s2)
            p, v = np.array(body.position_table_m), np.array(body.velocity_table_m_s)
            for span_s, a in ((late_s, acting[index]), (period_s - late_s, u)):
                p, v = p + v * span_s + 0.5 * a * span_s**2, v + a * span_s
            acting[index] = u
            bodies[index] = replace(body, position_table_m=tuple(p), velocity_table_m_s=tuple(v))
        yield [np.array(body.position_table_m) for body in bodies]


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), hold=st.sampled_from([1, 7, 60]))
def test_whatever_is_wanted_it_stays_on_the_table_and_apart(seed, hold):
    rng = np.random.default_rng(seed)
    bodies = [state(-0.6, 0.0), state(0.6, 0.2), state(0.0, 0.9)]
    kept = {}

    def wants(step, index, rng):
        if step % hold == 0:
            kind = rng.integers(3)
            angle = rng.uniform(-math.pi, math.pi)
            aim = bodies[(index + 1) % 3].position_table_m
            away = np.subtract(aim, bodies[index].position_table_m)
            kept[index] = (
                BRAKING_M_S2 * away / max(np.linalg.norm(away), 1e-6)
                if kind == 0
                else BRAKING_M_S2 * np.array((math.cos(angle), math.sin(angle)))
            )
        return kept[index]

    for places in fly(make(), bodies, wants, rng):
        for k, place in enumerate(places):
            assert min(TABLE.edge_distances_m(tuple(place))) > 0.0
            for other in places[:k]:
                assert np.linalg.norm(place - other) > REACH_M


def test_a_place_beside_the_edge_can_be_reached_and_held():
    """A goal one centimetre from the edge, flown by a proportional law: the filter does not push it away."""
    bodies = [state(1.4, 0.0)]

    def wants(step, index, rng):
        p, v = np.array(bodies[0].position_table_m), np.array(bodies[0].velocity_table_m_s)
        u = 0.09 * (np.array((1.79, 0.0)) - p) - 0.6 * v
        return u if np.linalg.norm(u) < BRAKING_M_S2 else u * BRAKING_M_S2 / np.linalg.norm(u)

    *_, last = fly(make(), bodies, wants, np.random.default_rng(1), steps=600)
    assert last[0] == pytest.approx((1.79, 0.0), abs=2e-3)


def test_forces_and_accelerations_go_there_and_back():
    wrench = BodyWrench((0.2, -0.1), 0.0)
    there = table_acceleration(wrench, 0.7, 11.0)
    assert body_force(there, 0.7, 11.0) == pytest.approx(wrench.force_body_n)
    assert table_acceleration(BodyWrench((11.0, 0.0), 0.0), math.pi / 2, 11.0) == pytest.approx((0.0, 1.0))


@pytest.mark.parametrize(
    ("wanted", "rate", "given"),
    [
        (0.1, 0.0, 0.1),
        (9.0, 0.0, 1.6),
        (9.0, 0.7, 0.2),
        (-9.0, 0.7, -3.0),
        (0.0, 1.0, -0.4),
        (0.0, -1.0, 0.4),
    ],
)
def test_no_torque_leads_beyond_the_largest_turn_rate(wanted, rate, given):
    assert make().turned(wanted, rate) == pytest.approx(given)


def test_a_place_to_rest_is_a_little_off_everything():
    assert make().resting_place((0.5, 0.2), []) == (0.5, 0.2)
    assert make().resting_place((1.79, 0.2), []) == pytest.approx((1.74, 0.2))
    assert make().resting_place((1.9, -1.4), []) == pytest.approx((1.74, -1.24))
    beside = Disc("beta", (0.43, 0.0), (0.0, 0.0), REACH_M, 1.0)
    assert make().resting_place((0.0, 0.0), [beside]) == pytest.approx((0.43 - REACH_M - 0.06, 0.0))


def test_where_nothing_is_off_everything_it_rests_where_it_is():
    around = [Disc(str(k), (0.1 * x, 0.0), (0.0, 0.0), 3.0, 1.0) for k, x in enumerate((-1, 1))]
    assert make().resting_place((0.0, 0.0), around) == (0.0, 0.0)
