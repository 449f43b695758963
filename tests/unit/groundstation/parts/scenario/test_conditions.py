"""What a timeline waits for holds when it should, and never on what is not known."""

import math

import pytest

from groundstation.parts.scenario.condition_text import ConditionError, plain, read_condition
from groundstation.parts.scenario.conditions import MEASURES, Bounds, Known

BOUNDS = Bounds((-2.0, 2.0), (-1.5, 1.5))
GROUPS = {"alpha": ("alpha",), "beta": ("beta",), "all": ("alpha", "beta"), "followers": ()}
S = 1_000_000_000


def at(x_m, y_m, *, now_ns=10 * S, speed_m_s=0.0, goal=None, heading_rad=0.0, mode="flying"):
    goal = (x_m, y_m) if goal is None else goal
    return Known(now_ns, (x_m, y_m), (speed_m_s, 0.0), heading_rad, now_ns, goal, 0.0, mode)


def holds(text, known, since_ns=0, now_ns=10 * S):
    return read_condition(text, GROUPS, BOUNDS).holds(known, BOUNDS, since_ns, now_ns)


def test_distances_are_between_hulls():
    known = {"alpha": at(-0.5, 0.0), "beta": at(0.5, 0.0)}  # 1 m between the centres, hulls of 0.2 m
    assert holds("distance_mm(alpha,beta) < 601", known)
    assert not holds("distance_mm(alpha,beta) < 599", known)
    assert holds("distance_mm(beta, alpha) > 599", known)


@pytest.mark.parametrize(
    ("text", "low", "high"),
    [
        ("edge_mm(alpha)", 299.0, 301.0),  # 0.5 m to the right edge less the hull
        ("speed_mm_s(alpha)", 39.0, 41.0),
        ("position_error_mm(alpha)", 499.0, 501.0),
        ("heading_error_deg(alpha)", 89.0, 91.0),
    ],
)
def test_numbers_of_one_vehicle(text, low, high):
    known = {"alpha": at(1.5, 0.0, speed_m_s=0.04, goal=(1.0, 0.0), heading_rad=math.pi / 2)}
    assert holds(f"{text} > {low}", known)
    assert holds(f"{text} < {high}", known)
    assert not holds(f"{text} < {low}", known)


def test_all_terms_have_to_hold():
    known = {"alpha": at(0.0, 0.0, mode="landed"), "beta": at(1.0, 0.0)}
    assert holds("alpha.landed and beta.flying", known)
    assert not holds("all.flying", known)


def test_what_is_old_or_unknown_does_not_hold():
    old = {"alpha": at(0.0, 0.0, now_ns=8 * S), "beta": at(1.0, 0.0)}
    assert not holds("distance_mm(alpha,beta) < 4000", old)
    assert not holds("distance_mm(alpha,beta) > 0", {"alpha": Known(), "beta": at(1.0, 0.0)})


def test_settled_is_counted_from_where_the_waiting_began():
    known = at(0.0, 0.0)
    for now_s in (1, 2, 3, 4):
        known.state_ns = known.setpoint_ns = now_s * S
        known.look(now_s * S)
    assert known.is_settled(0, 4 * S)
    assert not known.is_settled(2 * S, 4 * S)
    assert known.is_settled(2 * S, 5 * S)


@pytest.mark.parametrize(
    "wrong",
    [
        {"setpoint_table_m": (0.011, 0.0)},
        {"setpoint_heading_rad": math.radians(1.1)},
        {"velocity_table_m_s": (0.0, 0.006)},
        {"state_ns": 8 * S},
        {"setpoint_ns": 0},
        {"position_table_m": (math.nan, 0.0)},
    ],
)
def test_settled_ends_with_what_is_too_far_too_fast_or_too_old(wrong):
    known = at(0.0, 0.0)
    known.near_since_ns = 1 * S
    for name, value in wrong.items():
        setattr(known, name, value)
    known.look(10 * S)
    assert known.near_since_ns is None


def test_a_group_is_written_out_by_its_names():
    assert plain(read_condition("all.settled", GROUPS, BOUNDS)) == "alpha.settled and beta.settled"
    text = "distance_mm(alpha,beta) < 400"
    assert plain(read_condition(text, GROUPS, BOUNDS)) == text


@pytest.mark.parametrize("measure", MEASURES)
def test_a_number_that_no_table_can_give_is_refused(measure):
    names = ",".join(("alpha", "beta")[: MEASURES[measure].takes])
    if math.isfinite(MEASURES[measure].high(BOUNDS)):
        with pytest.raises(ConditionError, match="never come true"):
            read_condition(f"{measure}({names}) > 1e9", GROUPS, BOUNDS)
    if math.isfinite(MEASURES[measure].low):
        with pytest.raises(ConditionError, match="never come true"):
            read_condition(f"{measure}({names}) < -1", GROUPS, BOUNDS)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "and",
        "alpha",
        "alpha.settled or beta.settled",
        "speed_mm_s() < 3",
        "speed_mm_s(alpha) = 3",
        "speed_mm_s(alpha) < inf",
        "alpha.settled and",
    ],
)
def test_what_is_no_condition_is_refused_in_a_sentence(text):
    with pytest.raises(ConditionError):
        read_condition(text, GROUPS, BOUNDS)
