"""Who goes where: against all permutations, and the rules for those that fall out."""

import itertools
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.control.assignment import assign, reassigned

points = st.tuples(st.floats(-2, 2), st.floats(-2, 2))
NAMES = ("alpha", "beta", "gamma", "delta")


def cheapest(ships_m, places_m, cost):
    return min(
        sum(cost(math.dist(ship, places_m[place])) for ship, place in zip(ships_m, chosen, strict=True))
        for chosen in itertools.permutations(range(len(places_m)), len(ships_m))
    )


@given(
    ships_m=st.lists(points, min_size=1, max_size=4),
    spare=st.lists(points, max_size=2),
    places_m=st.lists(points, min_size=4, max_size=4),
)
@settings(max_examples=50)
def test_no_permutation_costs_less(ships_m, spare, places_m):
    ships = dict(zip(NAMES, ships_m, strict=False))
    places = places_m + spare
    found = assign(ships, places)
    total = sum(math.dist(ships[name], places[place]) ** 2 for name, place in found.items())
    assert total == pytest.approx(cheapest(ships_m, places, lambda way: way**2), abs=1e-9)
    assert len(set(found.values())) == len(ships)


def test_two_ships_do_not_cross_and_by_time_one_long_way_may_be_the_better_one():
    # along a line: shifting both by 0.5 m costs 2 x 0.25 m2, one jump of 1 m costs 1 m2
    ships, places = {"alpha": (0.0, 0.0), "beta": (0.5, 0.0)}, [(0.5, 0.0), (1.0, 0.0)]
    assert assign(ships, places) == {"alpha": 0, "beta": 1}
    # each way costs its ramps anew: from rest to rest 0.5 m take 10 s and 1 m takes 15 s
    assert assign(ships, places, "time") == {"alpha": 1, "beta": 0}


def test_a_short_way_has_no_cruise():
    # 0.02 m at 0.02 m/s2: 2 sqrt(s / a) = 2 s, and 4 x 0.02 m: 4 s; two of 2 s are as good as 0 and 4 s less
    ships = {"alpha": (0.0, 0.0), "beta": (0.02, 0.0)}
    assert assign(ships, [(0.02, 0.0), (0.04, 0.0)], "time") == {"alpha": 1, "beta": 0}


def test_fewer_places_than_ships_are_refused_in_a_sentence():
    with pytest.raises(ValueError, match=r"^2 ships need as many places, found 1: give more places$"):
        assign({"alpha": (0.0, 0.0), "beta": (1.0, 0.0)}, [(0.0, 0.0)])


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_place_nowhere_is_refused(bad):
    with pytest.raises(ValueError, match="finite"):
        assign({"alpha": (0.0, 0.0)}, [(bad, 0.0)])


@pytest.mark.parametrize("limits", [{"speed_m_s": 0.0}, {"acceleration_m_s2": 0.0}])
def test_time_without_motion_is_refused(limits):
    with pytest.raises(ValueError, match="above 0"):
        assign({"alpha": (0.0, 0.0)}, [(1.0, 0.0)], "time", **limits)


def test_nobody_needs_no_place():
    assert assign({}, []) == {}


LINE = [(0.0, 0.0), (0.6, 0.0), (1.2, 0.0), (1.8, 0.0)]
STOOD = {"alpha": 0, "beta": 1, "gamma": 2, "delta": 3}


def test_a_place_that_falls_empty_is_kept_by_rule():
    assert reassigned(STOOD, ["beta"], LINE, "keep") == {"alpha": 0, "gamma": 2, "delta": 3}


def test_a_place_that_falls_empty_is_filled_by_rule_and_the_last_one_falls_empty():
    filled = reassigned(STOOD, ["beta"], LINE, "fill")
    assert filled == {"alpha": 0, "gamma": 1, "delta": 2}


def test_nobody_is_sent_to_where_the_fallen_one_stands():
    assert reassigned(STOOD, ["beta"], LINE, "fill", blocked=[1]) == {"alpha": 0, "gamma": 2, "delta": 3}
    spare = [*LINE, (2.4, 0.0)]
    moved = reassigned(STOOD | {"delta": 4}, ["beta"], spare, "fill", blocked=[1])
    assert moved == {"alpha": 0, "gamma": 2, "delta": 3}


def test_who_is_at_a_place_that_is_blocked_stays_and_without_free_places_all_do():
    assert reassigned(STOOD, ["beta"], LINE, "fill", blocked=[0, 1]) == {"alpha": 0, "gamma": 2, "delta": 3}
    assert reassigned({"alpha": 1, "beta": 0}, ["beta"], LINE[:2], "fill", blocked=[0]) == {"alpha": 1}
