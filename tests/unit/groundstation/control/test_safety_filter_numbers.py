"""The safety filter's conditions, limits and constants, each number worked out by hand."""

import math

import pytest
from pydantic import ValidationError

from groundstation.control.keep_in import rectangle
from groundstation.control.safety_filter import (
    RESTING_M,
    Disc,
    SafetyFilter,
    SafetyFilterConfig,
    body_force,
    table_acceleration,
)
from groundstation.control.state import BodyWrench, ControlState, rotate

TABLE = rectangle((4.0, 3.0), margin_m=0.2)  # centres within 1.8 m and 1.3 m
HUGE = rectangle((400.0, 400.0))


def state(x=0.0, y=0.0, vx=0.0, vy=0.0, slope=(0.0, 0.0)):
    return ControlState((x, y), (vx, vy), 0.3, 0.0, slope)


def make(table=TABLE, **changes):
    return SafetyFilter(SafetyFilterConfig(**changes), table)


def half(table=TABLE):
    """Counts on half of 0.04 m/s^2: stops at 0.02, whatever is asked."""
    return make(table, share_of_braking=0.5)


def test_what_it_is_by_default():
    assert SafetyFilterConfig().model_dump() == {
        "reaction_s": 0.15,
        "reserve_s": 0.8,
        "gain_per_s": 1.0,
        "share_of_braking": 0.85,
        "torque_share": 0.25,
        "most_rate_rad_s": 0.8,
        "spin_down_s": 0.5,
    }
    assert RESTING_M == 0.06


@pytest.mark.parametrize(
    ("key", "low", "high", "is_low_taken"),
    [
        ("reaction_s", 0.0, 2.0, True),
        ("reserve_s", 0.0, 5.0, True),
        ("gain_per_s", 0.0, 5.0, False),
        ("share_of_braking", 0.0, 1.0, False),
        ("torque_share", 0.0, 1.0, True),
        ("most_rate_rad_s", 0.0, None, False),
        ("spin_down_s", 0.0, None, False),
    ],
)
def test_the_limits_of_what_may_be_set(key, low, high, is_low_taken):
    taken = [1e-3, *([low] if is_low_taken else []), *([high] if high is not None else [])]
    refused = [-1e-3, *([] if is_low_taken else [low]), *([1.001 * high] if high is not None else [])]
    for value in taken:
        assert getattr(SafetyFilterConfig(**{key: value}), key) == value
    for value in refused:
        with pytest.raises(ValidationError, match=key):
            SafetyFilterConfig(**{key: value})


def test_what_is_set_is_spelled_right_and_stays():
    with pytest.raises(ValidationError, match="reacton_s"):
        SafetyFilterConfig(reacton_s=0.1)
    with pytest.raises(ValidationError, match="frozen"):
        SafetyFilterConfig().reaction_s = 0.1


def test_straight_at_an_edge():
    # T = 0.15 + 0.8 + 0.1 / 0.04 = 3.45 s; h = 0.3 - 0.345 m; turned = 0.1 / (0.04 * 0.1) = 25
    # normal = 3.45 + 25 * 0.1 = 5.95; bound = -0.045 - 0.1
    found = half().filtered((0.03, 0.01), state(1.5, 0.0, 0.1), [], 0.04)
    assert found.acceleration_table_m_s2 == pytest.approx((-0.145 / 5.95, 0.01))
    assert found.limited_by == ("edge",)
    assert found.must_brake is False


def test_aslant_at_an_edge():
    # T as before; h = 0.3 - 0.06 * 3.45 = 0.093; turned = 0.06 / (0.04 * 0.1) = 15
    # normal = (3.45 + 15 * 0.06, 15 * 0.08) = (4.35, 1.2); bound = 0.093 - 0.06 = 0.033
    found = half().filtered((0.03, 0.01), state(1.5, 0.0, 0.06, 0.08), [], 0.04)
    share = (0.03 * 4.35 + 0.01 * 1.2 - 0.033) / (4.35**2 + 1.2**2)
    assert found.acceleration_table_m_s2 == pytest.approx((0.03 - 4.35 * share, 0.01 - 1.2 * share))


def test_aslant_at_another_edge_with_another_gain_and_downhill():
    # at y = -1.3: h = 0.3 - 0.08 * 3.45 = 0.024; turned = 20; normal = (20 * 0.06, -3.45 - 20 * 0.08)
    # bound = 2 * 0.024 - 0.08 - (1.2 * 0.001 + 5.05 * 0.002)
    filter_ = make(share_of_braking=0.5, gain_per_s=2.0)
    found = filter_.filtered((0.0, -0.01), state(0.0, -1.0, 0.06, -0.08, (0.001, -0.002)), [], 0.04)
    bound = 0.048 - 0.08 - 0.0113
    share = (0.0505 - bound) / (1.2**2 + 5.05**2)
    assert found.acceleration_table_m_s2 == pytest.approx((-1.2 * share, -0.01 + 5.05 * share))
    assert found.limited_by == ("edge",)


def test_leaving_an_edge_uses_no_room_up():
    # outside by 0.2 m and on the way back at 0.1 m/s: h = -0.2, normal = 3.45, bound = -0.2 + 0.1
    found = half().filtered((0.0, 0.0), state(2.0, 0.0, -0.1), [], 0.04)
    assert found.acceleration_table_m_s2 == pytest.approx((-0.1 / 3.45, 0.0))


def test_both_edges_of_a_corner_are_one_name():
    # T = 0.95 s at rest; 0.01 m outside of both
    found = half().filtered((0.0, 0.0), state(1.81, 1.31), [], 0.04)
    assert found.acceleration_table_m_s2 == pytest.approx((-0.01 / 0.95, -0.01 / 0.95))
    assert found.limited_by == ("edge",)


@pytest.mark.parametrize("angle_rad", [0.0, 0.9, 2.5, -1.2])
@pytest.mark.parametrize(
    ("velocity", "reach_m", "share", "along"),
    [
        # it comes at 0.06 m/s, |v| = 0.1: its way 0.06 * 3.45 = 0.207; own T = 0.95 + 0.05 / 0.04 = 2.2 s,
        # h = 1 - 0.4 - 0.11 - 0.207 = 0.283; normal 2.2 + 25 * 0.05 = 3.45
        ((-0.06, 0.08), 0.4, 1.0, (0.283 - 0.05 - 0.06) / 3.45),
        ((-0.06, 0.08), 0.4, 0.5, (0.5 * 0.283 - 0.05) / 3.45),
        # it goes away: h = 1 - 0.95 - 0.11 = -0.06
        ((0.06, 0.08), 0.95, 1.0, (-0.06 - 0.05 + 0.06) / 3.45),
        ((0.06, 0.08), 0.9, 0.5, (-0.5 * 0.01 - 0.05) / 3.45),
        ((0.0, 0.0), 0.9, 1.0, (-0.01 - 0.05) / 3.45),
    ],
)
def test_another_body(angle_rad, velocity, reach_m, share, along):
    turn = lambda vector: rotate(vector, angle_rad)  # noqa: E731
    here, there = (0.1, -0.2), turn((1.0, 0.0))
    beta = Disc("beta", (here[0] + there[0], here[1] + there[1]), turn(velocity), reach_m, share)
    filter_ = make(HUGE, share_of_braking=0.25)
    found = filter_.filtered(turn((0.06, 0.01)), state(*here, *turn((0.05, 0.0))), [beta], 0.08)
    assert found.acceleration_table_m_s2 == pytest.approx(turn((along, 0.01)))
    assert found.limited_by == ("beta",)
    assert found.must_brake is False


def test_on_one_spot_it_goes_to_minus_x():
    found = make().filtered((0.0, 0.0), state(), [Disc("beta", (0.0, 0.0), (0.0, 0.0), 0.019, 1.0)], 0.03)
    assert found.acceleration_table_m_s2 == pytest.approx((-0.02, 0.0))
    assert found.must_brake is False


def whole(room_m=-0.5):
    """T = 1 s at rest, so the condition is an acceleration of as much as there is room."""
    return make(rectangle((4.0, 4.0)), reaction_s=0.5, reserve_s=0.5), state(2.0 - room_m)


def test_all_that_the_valves_can_make_is_still_asked_of_them():
    filter_, outside = whole()
    assert filter_.filtered((0.0, 0.0), outside, [], 0.5) == ((-0.5, 0.0), ("edge",), False)
    assert filter_.filtered((0.0, 0.0), outside, [], 0.4999) == ((0.0, 0.0), ("edge",), True)


def test_only_what_is_broken_is_named_when_it_must_brake():
    filter_, _ = whole()
    rock = Disc("rock", (1.0, 0.0), (0.0, 0.0), 1.5, 1.0)
    pebble = Disc("pebble", (0.0, -1.0), (0.0, 0.0), 0.5, 1.0)
    # wanted is exactly what the edge at y = 2 allows, and away from the pebble
    found = filter_.filtered((0.0, 2.0), state(), [rock, pebble], 0.1)
    assert found == ((0.0, 0.0), ("rock",), True)


def test_between_two_that_leave_nothing_it_must_brake_and_both_are_named():
    filter_, _ = whole()
    sides = [Disc(name, (x, 0.0), (0.0, 0.0), 1.1, 1.0) for name, x in (("left", -1.0), ("right", 1.0))]
    assert filter_.filtered((0.0, 0.0), state(), sides, 1.0) == ((0.0, 0.0), ("left", "right"), True)


@pytest.mark.parametrize(("needed_m_s2", "must_brake"), [(0.95e-6, False), (1.05e-6, True)])
def test_without_valves_a_millionth_is_counted_on(needed_m_s2, must_brake):
    filter_ = make(rectangle((4.0, 4.0)), reaction_s=0.5, reserve_s=0.5, share_of_braking=1.0)
    found = filter_.filtered((0.1, 0.0), state(2.0 - needed_m_s2), [], 0.0)
    assert found.must_brake is must_brake


def test_the_least_braking_is_what_way_is_reckoned_with():
    # v = 1e-6 m/s, a = 1e-6: T = 1 + 0.5 s; turned = 0.5 / 1e-6 * 1e-6; normal = 2; bound = h - v
    filter_ = make(rectangle((4.0, 4.0)), reaction_s=0.5, reserve_s=0.5)
    found = filter_.filtered((1e-3, 0.0), state(2.0 - 3.5e-6, 0.0, 1e-6), [], 0.0)
    assert found.acceleration_table_m_s2[0] == pytest.approx((3.5e-6 - 1.5e-6 - 1e-6) / 2.0, rel=1e-3)


def test_a_place_to_rest_aslant_of_another_body():
    # 0.45 m away along (0.6, 0.8); 0.4 + 0.06 is wanted
    beside = Disc("beta", (0.37, 0.56), (0.0, 0.0), 0.4, 1.0)
    found = make().resting_place((0.1, 0.2), [beside])
    assert found == pytest.approx((0.37 - 0.46 * 0.6, 0.56 - 0.46 * 0.8))


def test_forces_by_hand():
    quarter = math.pi / 2
    assert table_acceleration(BodyWrench((2.0, 4.0), 0.0), quarter, 2.0) == pytest.approx((-2.0, 1.0))
    assert body_force((-2.0, 1.0), quarter, 2.0) == pytest.approx((2.0, 4.0))
