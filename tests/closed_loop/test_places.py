"""A ship of three leaves its place and comes down: its place is filled or kept, as the rule says."""

import math
from pathlib import Path

import numpy as np
import pytest

from groundstation import scenario

FILE = Path(__file__).parents[2] / "examples" / "scenarios" / "place_filled.toml"
FIRST, SECOND, THIRD = (0.0, -0.6), (-0.8, -0.2), (-0.2, 0.3)
SHIPS = ("alpha", "beta", "gamma")


def place_at(flown, vehicle, t_s):
    """By truth, m."""
    t, x_m, y_m, *_ = flown.truth(vehicle)
    row = np.searchsorted(t, t_s) - 1
    return float(x_m[row]), float(y_m[row])


def flown_with(rule):
    plan = scenario.load(FILE)
    changes = {f"vehicles.{ship}.control.parameters.empty": rule for ship in SHIPS}
    return scenario.run(plan.vary(changes))


@pytest.mark.slow
def test_the_next_one_moves_up_where_the_rule_is_to_fill_and_the_last_place_is_empty():
    flown = flown_with("fill")
    assert flown.passed, flown.reason
    assert math.dist(place_at(flown, "gamma", 60.0), THIRD) < 0.015
    assert math.dist(place_at(flown, "gamma", 104.0), FIRST) < 0.015
    assert math.dist(place_at(flown, "beta", 104.0), SECOND) < 0.015


@pytest.mark.slow
def test_nobody_moves_where_the_rule_is_to_keep():
    flown = flown_with("keep")
    assert flown.reason.startswith("timeline.3: 'distance_mm(beta,gamma) > 470'")
    t, *_ = flown.truth("beta")
    assert t[-1] > 90.0
    assert math.dist(place_at(flown, "beta", t[-1]), SECOND) < 0.015
    assert math.dist(place_at(flown, "gamma", t[-1]), THIRD) < 0.015
