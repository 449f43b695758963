"""Plans of several ships, looked at by brute force: nobody meets, nobody is asked for too much."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from groundstation.control.keep_in import rectangle
from groundstation.control.planning import plan
from groundstation.control.trajectories import Margins, NoSafeWayError, Plan, Reconfiguration
from groundstation.control.trajectory_check import objection

KEEP_IN = rectangle((4.0, 3.0), margin_m=0.2)
MARGINS = Margins()
STARTS = ((-1.3, -0.8), (-1.3, 0.8), (0.0, 0.9), (1.3, 0.8), (1.3, -0.8))
ACROSS = ((1.3, 0.8), (1.3, -0.8), (0.0, -0.9), (-1.3, -0.8), (-1.3, 0.8))
HEAD_ON = Reconfiguration(((-1.0, 0.0), (1.0, 0.0)), ((1.0, 0.0), (-1.0, 0.0)), KEEP_IN)
STEP_S = 0.02


def flown(made):
    """Positions every 20 ms by the plan's own values, velocities and accelerations by differences."""
    t_s = np.arange(0.0, made.duration_s, STEP_S)
    positions_m = made.sampled(t_s)
    velocities_m_s = np.diff(positions_m, axis=0) / STEP_S
    return positions_m, velocities_m_s, np.diff(velocities_m_s, axis=0) / STEP_S


def check(asked, made):
    positions_m, velocities_m_s, accelerations_m_s2 = flown(made)
    margins = asked.margins
    assert positions_m[0] == pytest.approx(np.array(asked.starts_m))
    assert made.at(1e9)[0] == pytest.approx(np.array(asked.goals_m))
    assert np.linalg.norm(velocities_m_s, axis=2).max() <= margins.speed_m_s + 1e-9
    assert np.linalg.norm(accelerations_m_s2, axis=2).max() <= margins.acceleration_m_s2 + 1e-9
    for one, other in itertools.combinations(range(len(asked.starts_m)), 2):
        apart_m = np.linalg.norm(positions_m[:, one] - positions_m[:, other], axis=1)
        assert apart_m.min() >= 2 * margins.radius_m + margins.gap_m
    for x, y, radius in asked.obstacles_m:
        apart_m = np.linalg.norm(positions_m - (x, y), axis=2)
        assert apart_m.min() >= margins.radius_m + radius + margins.gap_m
    assert np.abs(positions_m[..., 0]).max() <= 1.8
    assert np.abs(positions_m[..., 1]).max() <= 1.3


def spread(rng):
    """Five places on the table that are apart."""
    while True:
        places = rng.uniform((-1.6, -1.1), (1.6, 1.1), (5, 2))
        if min(math.dist(a, b) for a, b in itertools.combinations(places, 2)) > 0.6:
            return tuple(map(tuple, places.tolist()))


def test_two_that_would_meet_head_on_pass_each_other_on_the_right():
    made = plan(HEAD_ON)
    check(HEAD_ON, made)
    middle_m = made.at(made.duration_s / 2)[0]
    assert middle_m[0, 1] < -0.2  # who flies towards +x has its right at -y
    assert middle_m[1, 1] > 0.2


def test_who_brakes_at_any_moment_stops_before_the_other_one():
    positions_m, velocities_m_s, _ = flown(plan(HEAD_ON))
    a, b = positions_m[:-1, 0], positions_m[:-1, 1]
    unit = (b - a) / np.linalg.norm(b - a, axis=1)[:, None]
    one, other = velocities_m_s[:, 0], velocities_m_s[:, 1]
    needs_m = np.zeros(len(unit))
    for along, whole in (((one * unit).sum(axis=1), one), (-(other * unit).sum(axis=1), other)):
        speed = np.linalg.norm(whole, axis=1)
        needs_m += np.maximum(along, 0.0) * (MARGINS.reaction_s + speed / (2 * MARGINS.braking_m_s2))
    closing = ((one - other) * unit).sum(axis=1) > 0.0
    left_m = np.linalg.norm(b - a, axis=1) - 0.4 - needs_m
    assert left_m[closing].min() >= MARGINS.stopping_gap_m - 1e-4


def test_five_ships_change_sides():
    asked = Reconfiguration(STARTS, ACROSS, KEEP_IN, duration_s=74.0)
    made = plan(asked)
    check(asked, made)
    assert made.duration_s == 74.0


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_five_ships_go_from_anywhere_to_anywhere(seed):
    rng = np.random.default_rng(seed)
    asked = Reconfiguration(spread(rng), spread(rng), KEEP_IN)
    check(asked, plan(asked))


def test_an_obstacle_in_the_way_is_gone_round():
    asked = Reconfiguration(((-1.0, 0.0),), ((1.0, 0.0),), KEEP_IN, ((0.0, 0.0, 0.15),))
    check(asked, plan(asked))


def test_alone_it_flies_nearly_the_way_of_least_effort():
    """From rest to rest over s in T the integral of a^2 is at least 12 s^2 / T^3."""
    asked = Reconfiguration(((-1.0, 0.0),), ((1.0, 0.5),), KEEP_IN, duration_s=60.0)
    least = 12 * (2.0**2 + 0.5**2) / 60.0**3
    assert least <= plan(asked).effort <= 1.15 * least  # splines that end without acceleration


def test_the_same_question_has_the_same_answer():
    first = plan(HEAD_ON).control_m
    plan.cache_clear()
    assert (plan(HEAD_ON).control_m == first).all()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"goals_m": ((1.0, 0.0),)}, r"^2 starts need as many goals, found 1$"),
        ({"goals_m": ((1.0, 0.0), (0.6, 0.0))}, r"^the goals are no places to rest at: ships 0 and 1 "),
        (
            {"starts_m": ((-3.0, 0.0), (1.0, 0.0))},
            r"^the starts are no places to rest at: ship 0 and the edge",
        ),
        (
            {"obstacles_m": ((1.0, 0.1, 0.1),)},
            r"^the starts are no places to rest at: ship 1 and an obstacle",
        ),
        ({"goals_m": ((math.nan, 0.0), (-1.0, 0.0))}, "finite"),
        ({"duration_s": 12.0}, r"^no safe way was found within 12 s: .*; give more time, or other places$"),
    ],
)
def test_what_cannot_be_made_safe_is_refused_in_a_sentence(changes, words):
    with pytest.raises(NoSafeWayError, match=words):
        plan(replace(HEAD_ON, **changes))


def test_the_look_afterwards_finds_what_the_programme_did_not():
    made = plan(HEAD_ON)
    assert objection(HEAD_ON, made) == ""
    straight = made.control_m.copy()
    straight[..., 1] = 0.0
    assert "would come as near as -" in objection(HEAD_ON, Plan(made.family, straight))
    hurried = Plan(type(made.family)(made.duration_s / 3, made.family.spans), made.control_m)
    assert "would need" in objection(HEAD_ON, hurried)
    wide = replace(HEAD_ON, keep_in=rectangle((4.0, 0.8), margin_m=0.2))
    assert "and the edge" in objection(wide, made)
    late = replace(HEAD_ON, margins=replace(MARGINS, reaction_s=9.0))
    assert "by braking" in objection(late, made)
