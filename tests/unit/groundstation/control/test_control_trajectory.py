"""Ships that fly one plan: each by its own copy of the law, on a table without friction or noise."""

import math

import numpy as np
import pytest

from groundstation.control.controllers import make_controller
from groundstation.control.keep_in import rectangle
from groundstation.control.state import ControlState, Goal, rotate
from groundstation.control.vehicle import VehicleModel, square_of_eight

VEHICLE = VehicleModel(11.0, 0.25, square_of_eight())
KEEP_IN = rectangle((4.0, 3.0), margin_m=0.2)
DT_S = 0.1
STARTS = {"alpha": (-1.0, 0.0), "beta": (1.0, 0.0), "gamma": (0.0, 1.0)}
PLACES = ((1.0, 0.0), (-1.0, 0.0), (0.0, -1.0))


def law(ship, **parameters):
    given = {"ship": ship, "starts_m": STARTS, "places_m": PLACES, **parameters}
    return make_controller("trajectory", given, VEHICLE, KEEP_IN)


class Table:
    """Ships as double integrators; `held` ones stay where they are, `hidden` ones are not seen."""

    def __init__(self, laws, at_m=STARTS):
        self.laws, self.states = laws, {}
        self.held, self.hidden = set(), set()
        self.least_m = math.inf
        for name in laws:
            self.states[name] = ControlState(at_m[name], (0.0, 0.0), 0.0, 0.0)

    def fly(self, span_s):
        for _ in range(round(span_s / DT_S)):
            pushed = {}
            for name, law in self.laws.items():
                others = {
                    other: state
                    for other, state in self.states.items()
                    if other not in (name, *self.hidden) and name not in self.hidden
                }
                goal = Goal(STARTS[name], 0.0)
                pushed[name] = law.update(self.states[name], goal, DT_S, neighbours=others)
            for name, wrench in pushed.items():
                if name not in self.held:
                    self.states[name] = moved(self.states[name], wrench)
            places = [state.position_table_m for state in self.states.values()]
            self.least_m = min([self.least_m, *(math.dist(a, b) for a in places for b in places if a != b)])

    def place(self, name):
        return self.states[name].position_table_m


def moved(state, wrench):
    force = rotate(wrench.force_body_n, state.heading_rad)
    ax, ay = force[0] / VEHICLE.mass_kg, force[1] / VEHICLE.mass_kg
    (x, y), (vx, vy) = state.position_table_m, state.velocity_table_m_s
    return ControlState(
        (x + vx * DT_S + 0.5 * ax * DT_S**2, y + vy * DT_S + 0.5 * ay * DT_S**2),
        (vx + ax * DT_S, vy + ay * DT_S),
        state.heading_rad,
        0.0,
    )


@pytest.fixture
def table():
    return Table({name: law(name) for name in STARTS})


def test_each_arrives_at_its_place_and_nobody_comes_near(table):
    duration_s = table.laws["alpha"].plan.duration_s
    table.fly(duration_s + 10.0)
    for name, place in zip(STARTS, PLACES, strict=True):
        assert math.dist(table.place(name), place) < 0.003
    assert table.least_m > 0.4 + 0.10


def test_all_make_the_same_plan_by_themselves():
    plans = [law(name).plan.control_m for name in STARTS]
    assert all((plan == plans[0]).all() for plan in plans)


def test_places_go_to_whom_they_suit_best():
    near = ((0.0, 0.9), (-0.9, 0.0), (0.9, 0.0))
    chosen = law("alpha", places_m=near, assign="squared_distance").plan
    assert chosen.at(1e9)[0] == pytest.approx(np.array([near[1], near[2], near[0]]))


def test_one_that_is_held_makes_all_wait_and_they_go_on_with_it(table):
    table.fly(15.0)
    table.held = {"beta"}
    table.states["beta"] = ControlState(table.place("beta"), (0.0, 0.0), 0.0, 0.0)
    table.fly(20.0)
    stood = {name: table.place(name) for name in STARTS}
    table.fly(10.0)
    for name in STARTS:
        assert math.dist(table.place(name), stood[name]) < 0.02
    table.held = set()
    table.fly(60.0)
    for name, place in zip(STARTS, PLACES, strict=True):
        assert math.dist(table.place(name), place) < 0.005
    assert table.least_m > 0.4 + 0.05


def test_one_that_is_not_seen_stops_all_of_them(table):
    table.fly(15.0)
    table.hidden = {"gamma"}
    table.fly(12.0)
    for name in STARTS:
        assert math.hypot(*table.states[name].velocity_table_m_s) < 0.003


def test_nobody_begins_before_all_are_at_their_starts(table):
    table.states["gamma"] = ControlState((0.5, 1.0), (0.0, 0.0), 0.0, 0.0)
    table.fly(20.0)
    assert table.place("alpha") == pytest.approx(STARTS["alpha"], abs=1e-6)
    # and who is far from its start does not fly there without a plan
    assert table.place("gamma") == pytest.approx((0.5, 1.0), abs=0.01)


def test_one_that_is_near_its_start_goes_there_first(table):
    table.states["gamma"] = ControlState((0.15, 1.0), (0.0, 0.0), 0.0, 0.0)
    table.fly(table.laws["alpha"].plan.duration_s + 25.0)
    assert table.place("gamma") == pytest.approx(PLACES[2], abs=0.005)


def test_who_is_armed_anew_at_its_place_stays_there(table):
    table.fly(table.laws["alpha"].plan.duration_s + 10.0)
    table.laws["beta"].reset()
    table.fly(10.0)
    assert table.place("beta") == pytest.approx(PLACES[1], abs=0.003)


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"ship": "delta"}, r"^starts_m: 'delta' is none of the ships that start \(alpha, beta, gamma\)$"),
        ({"places_m": PLACES[:2]}, r"^3 ships need as many places, found 2: give more places$"),
        ({"acceleration_m_s2": 0.03}, "^acceleration_m_s2: 0.03 is more than the 0.024 "),
        ({"braking_m_s2": 0.03}, "^braking_m_s2: 0.03 is more than the 0.026 "),
        ({"duration_s": 10.0}, "^no safe way was found within 10 s"),
    ],
)
def test_what_cannot_be_flown_is_refused_in_a_sentence(parameters, words):
    with pytest.raises(ValueError, match=words):
        law(**{"ship": "alpha", **parameters})


ROW = ((0.0, -0.6), (-0.8, -0.2), (0.8, 0.0), (-0.2, 0.6))
STAND = {"alpha": (0.0, -0.6), "beta": (-0.8, -0.2), "gamma": (0.8, 0.0)}


@pytest.fixture
def row():
    """Makes three ships that stand in a row, by a rule for places that fall empty."""

    def make(rule):
        laws = {name: law(name, starts_m=STAND, places_m=ROW, empty=rule) for name in STAND}
        table = Table(laws, STAND)
        table.fly(5.0)
        return table

    return make


def fallen(table, name, place_m):
    """A ship comes down somewhere: it is not seen by its state any more, its supervisor says so."""
    table.hidden = {name}
    table.held = {name}
    table.states[name] = ControlState(place_m, (0.0, 0.0), 0.0, 0.0)
    for other, each in table.laws.items():
        if other != name:
            each.see_fallen({name: place_m})


def test_the_place_of_who_came_down_elsewhere_is_filled_by_rule(row):
    table = row("fill")
    fallen(table, "alpha", (-1.4, -0.9))
    table.fly(40.0)
    # gamma's way to it is 1.0 m; beta's is shorter, but then gamma would have to take beta's place
    assert table.place("gamma") == pytest.approx(ROW[0], abs=0.005)
    assert table.place("beta") == pytest.approx(ROW[1], abs=0.005)
    assert table.least_m > 0.4 + 0.10


@pytest.mark.parametrize(("rule", "lies_m"), [("keep", (-1.4, -0.9)), ("fill", (0.03, -0.58))])
def test_a_place_stays_empty_by_rule_and_where_the_fallen_one_lies_in_it(row, rule, lies_m):
    table = row(rule)
    fallen(table, "alpha", lies_m)
    table.fly(30.0)
    assert table.place("beta") == pytest.approx(ROW[1], abs=0.005)
    assert table.place("gamma") == pytest.approx(ROW[2], abs=0.005)


def test_one_that_comes_down_beside_all_ways_is_not_waited_for(table):
    table.fly(12.0)
    fallen(table, "gamma", (-1.7, 1.2))
    table.fly(60.0)
    for name in ("alpha", "beta"):
        assert math.dist(table.place(name), PLACES[list(STARTS).index(name)]) < 0.005


def test_one_that_comes_down_on_a_way_stops_the_others(table):
    table.fly(12.0)
    on_way_m = tuple(table.laws["alpha"].plan.at(20.0)[0][0].tolist())
    fallen(table, "gamma", on_way_m)
    table.fly(30.0)
    for name in ("alpha", "beta"):
        assert math.hypot(*table.states[name].velocity_table_m_s) < 0.003
        assert math.dist(table.place(name), PLACES[list(STARTS).index(name)]) > 0.2


def test_a_second_one_that_comes_down_is_answered_too(row):
    table = row("fill")
    fallen(table, "alpha", (0.0, -0.6))  # in its place: nobody moves
    table.fly(6.0)
    table.hidden |= {"beta"}
    table.held |= {"beta"}
    table.laws["gamma"].see_fallen({"alpha": (0.0, -0.6), "beta": (-1.6, 1.1)})
    table.fly(40.0)
    assert table.place("gamma") == pytest.approx(ROW[1], abs=0.005)
