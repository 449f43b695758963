"""Stopping distances of two mock-ups on their way to each other; numbers by hand."""

import math

import pytest

from groundstation.control.edge import EdgeVerdict
from groundstation.control.state import ControlState
from groundstation.supervision.clearance import Clearance, clearance

A_M_S2 = 0.05


def moving(x, y, speed_x=0.0, speed_y=0.0):
    return ControlState((x, y), (speed_x, speed_y), 0.0, 0.0)


def first(state, others, reserve_m=0.03):
    return clearance(state, others, A_M_S2, reaction_s=0.5, radius_m=0.15, reserve_m=reserve_m)


def test_nobody_else_is_clear():
    assert first(moving(0, 0, 1.0), {}) == Clearance(EdgeVerdict.CLEAR, "", math.inf)


def test_one_that_stands_is_met_after_the_stopping_distance_of_the_other():
    # 1 m between centres, 0.3 m of bodies, 0.1 m/s: 0.05 m of reaction and 0.1^2 / 0.1 = 0.1 m of braking
    found = first(moving(0, 0, 0.1), {"beta": moving(1.0, 0)})
    assert found.name == "beta"
    assert found.room_m == pytest.approx(1.0 - 0.3 - 0.05 - 0.1)
    assert found.verdict is EdgeVerdict.CLEAR


def test_one_that_comes_nearer_needs_its_own_way_too():
    # the other one: 0.2 m/s: 0.1 m of reaction and 0.04 / 0.1 = 0.4 m of braking
    found = first(moving(0, 0, 0.1), {"beta": moving(1.0, 0, -0.2)})
    assert found.room_m == pytest.approx(1.0 - 0.3 - 0.15 - 0.5)


def test_one_that_flees_slower_is_met_and_faster_is_not():
    slower = first(moving(0, 0, 0.1), {"beta": moving(1.0, 0, 0.05)})
    assert slower.room_m == pytest.approx(1.0 - 0.3 - 0.15)
    assert first(moving(0, 0, 0.1), {"beta": moving(1.0, 0, 0.1)}).name == ""
    assert first(moving(0, 0, 0.1), {"beta": moving(1.0, 0, 0.2)}).name == ""


@pytest.mark.parametrize("speed_x", [0.0, -0.1])
def test_one_that_stands_or_goes_away_leaves_braking_to_the_other(speed_x):
    assert first(moving(0, 0, speed_x), {"beta": moving(1.0, 0, -0.2)}).name == ""


def test_what_counts_is_the_speed_along_the_line_and_braking_along_the_velocity():
    # 3-4-5: along the line 0.6 of 0.1 m/s; braking takes speed / (2 a) = 1 s for the whole of it
    found = first(moving(0, 0, 0.06, 0.08), {"beta": moving(1.0, 0)})
    assert found.room_m == pytest.approx(1.0 - 0.3 - 0.06 * (0.5 + 1.0))
    upwards = first(moving(0.2, 0.1, 0.0, 0.1), {"beta": moving(0.2, 1.1)})
    assert upwards.room_m == pytest.approx(0.7 - 0.15)
    slanting = first(moving(0.1, 0.2, 0.06, 0.08), {"beta": moving(1.3, 1.8, -0.06, -0.08)})
    assert slanting.room_m == pytest.approx(1.7 - 0.15 - 0.15)


def test_passing_by_is_no_approach():
    assert first(moving(0, 0, 0.0, 0.1), {"beta": moving(1.0, 0)}).name == ""


@pytest.mark.parametrize(
    ("apart_m", "verdict"),
    [(0.4801, "CLEAR"), (0.4799, "BRAKE"), (0.4501, "BRAKE"), (0.4499, "TOO_LATE")],
)
def test_the_nearer_the_sterner(apart_m, verdict):
    found = first(moving(0, 0, 0.1), {"beta": moving(apart_m, 0)})
    assert found.verdict is EdgeVerdict[verdict]


@pytest.mark.parametrize(("room_m", "verdict"), [(0.25, "CLEAR"), (0.0, "BRAKE")])
def test_exactly_the_reserve_is_clear_and_exactly_touching_is_not_too_late(room_m, verdict):
    # powers of two: 0.25 m/s, a = 0.25 m/s2, no reaction: 0.125 m of braking, bodies of 0.125 m
    found = clearance(
        moving(0, 0, 0.25),
        {"beta": moving(0.375 + room_m, 0)},
        0.25,
        reaction_s=0.0,
        radius_m=0.125,
        reserve_m=0.25,
    )
    assert (found.room_m, found.verdict) == (room_m, EdgeVerdict[verdict])


def test_the_reserve_is_three_centimetres_unless_stated():
    def usual(apart_m):
        others = {"beta": moving(apart_m, 0)}
        return clearance(moving(0, 0, 0.1), others, A_M_S2, reaction_s=0.5, radius_m=0.15).verdict

    assert usual(0.4801) is EdgeVerdict.CLEAR
    assert usual(0.4799) is EdgeVerdict.BRAKE


def test_the_one_that_is_met_first_is_named():
    others = {"beta": moving(1.0, 0), "gamma": moving(0.6, 0), "delta": moving(0.8, 0), "far": moving(-1, 0)}
    found = first(moving(0, 0, 0.1), others)
    assert (found.name, found.verdict) == ("gamma", EdgeVerdict.CLEAR)
    assert found.room_m == pytest.approx(0.15)


def test_of_two_with_equal_room_the_first_is_named():
    assert first(moving(0, 0, 0.1), {"beta": moving(1, 0), "gamma": moving(1, 0)}).name == "beta"


def test_two_on_one_spot_overlap_if_either_moves_along():
    found = first(moving(0, 0, 0.1), {"beta": moving(0, 0)})
    assert found.verdict is EdgeVerdict.TOO_LATE
    assert found.room_m == pytest.approx(-0.3 - 0.15)
    assert first(moving(0, 0, 0.0, 0.1), {"beta": moving(0, 0)}).name == ""
