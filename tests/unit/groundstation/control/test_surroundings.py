"""What stands around: ages, doubts, shares, obstacles; numbers by hand."""

import math

import pytest

from groundstation.control.state import ControlState
from groundstation.control.surroundings import TOUCH_RESERVE_M, Obstacle, Surroundings

S = 1_000_000_000


def state(x=0.0, vx=0.0):
    return ControlState((x, 0.0), (vx, 0.0), 0.1, 0.0)


def disc(surroundings, now_ns=0, own=(0.0, 0.0), exempt=frozenset()):
    [found] = surroundings.discs(own, now_ns, exempt)
    return found


def test_a_report_is_carried_to_the_present():
    around = Surroundings(0.2)
    around.see("beta", state(1.0, 0.1), (0.0, 0.0), 0, is_flown=True)
    found = disc(around, S // 2)
    assert found.position_table_m == pytest.approx((1.05, 0.0))
    assert found.velocity_table_m_s == (0.1, 0.0)
    assert around.others(S // 2)["beta"].position_table_m == pytest.approx((1.05, 0.0))


def test_who_is_silent_stands_where_he_would_have_been_after_a_second():
    around = Surroundings(0.2)
    around.see("beta", state(1.0, 0.1), (0.0, 0.0), 0, is_flown=True)
    found = disc(around, 100 * S)
    assert found.position_table_m == pytest.approx((1.1, 0.0))
    assert found.velocity_table_m_s == (0.0, 0.0)
    assert found.share == 1.0


@pytest.mark.parametrize(
    ("speed", "is_flown", "share"), [(0.1, True, 0.5), (0.1, False, 1.0), (0.004, True, 1.0)]
)
def test_only_who_flies_and_moves_keeps_to_his_half(speed, is_flown, share):
    around = Surroundings(0.2)
    around.see("beta", state(1.0, speed), (0.0, 0.0), 0, is_flown=is_flown)
    assert disc(around).share == share


@pytest.mark.parametrize("sigma", [math.nan, math.inf, 10.0])
def test_doubts_of_both_places_widen_it_but_not_without_end(sigma):
    around = Surroundings(0.2)
    around.see("beta", state(1.0), (0.003, 0.004), 0, is_flown=True)
    expected = 0.4 + TOUCH_RESERVE_M + math.hypot(3 * 0.005, 3 * 0.013)
    assert disc(around, own=(0.005, 0.012)).reach_m == pytest.approx(expected)
    around.see("beta", state(1.0), (sigma, 0.0), 0, is_flown=True)
    assert disc(around).reach_m == pytest.approx(0.4 + TOUCH_RESERVE_M + 0.15)


def test_obstacles_stand_still_and_are_kept_out_of_as_a_whole():
    around = Surroundings(0.2, (Obstacle("lamp", (0.5, 0.5), 0.1),))
    found = disc(around, own=(0.01, 0.0))
    assert (found.name, found.position_table_m, found.velocity_table_m_s) == ("lamp", (0.5, 0.5), (0.0, 0.0))
    assert found.reach_m == pytest.approx(0.3 + TOUCH_RESERVE_M + 0.03)
    assert found.share == 1.0


def test_who_docks_with_it_may_touch_it():
    around = Surroundings(0.2)
    around.see("beta", state(1.0), (0.0, 0.0), 0, is_flown=True)
    around.see("gamma", state(2.0), (0.0, 0.0), 0, is_flown=True)
    assert disc(around, exempt=frozenset({"beta"})).name == "gamma"


@pytest.mark.parametrize(("age_s", "share", "x"), [(1.0, 0.5, 1.1), (1.05, 1.0, 1.1), (0.95, 0.5, 1.095)])
def test_a_second_of_silence_is_still_none(age_s, share, x):
    around = Surroundings(0.2)
    around.see("beta", state(1.0, 0.1), (0.0, 0.0), 0, is_flown=True)
    found = disc(around, round(age_s * S))
    assert found.share == share
    assert found.position_table_m == pytest.approx((x, 0.0))


def test_who_is_silent_has_stopped_and_does_not_turn():
    around = Surroundings(0.2)
    around.see("beta", ControlState((1.0, 2.0), (0.1, -0.2), 0.3, 0.5), (0.0, 0.0), 5 * S, is_flown=True)
    stands = around.others(7 * S)["beta"]
    assert stands.position_table_m == pytest.approx((1.1, 1.8))
    assert stands.velocity_table_m_s == (0.0, 0.0)
    assert (stands.heading_rad, stands.rate_rad_s) == (pytest.approx(0.8), 0.0)


@pytest.mark.parametrize(("speed", "share"), [(0.0052, 0.5), (0.005, 1.0), (0.0048, 1.0)])
def test_what_counts_as_moving(speed, share):
    around = Surroundings(0.2)
    around.see("beta", state(1.0, speed), (0.0, 0.0), 0, is_flown=True)
    assert disc(around).share == share


@pytest.mark.parametrize("own", [(1.0, 0.0), (math.nan, 0.0), (math.inf, math.inf)])
def test_the_doubt_of_the_own_place_has_an_end_too(own):
    around = Surroundings(0.2, (Obstacle("lamp", (0.5, 0.5), 0.1),))
    assert disc(around, own=own).reach_m == pytest.approx(0.2 + 0.1 + 0.02 + 0.15)


@pytest.mark.parametrize(("sigma_m", "doubt_m"), [(0.049, 0.147), (0.051, 0.15)])
def test_where_the_doubt_ends(sigma_m, doubt_m):
    around = Surroundings(0.2)
    around.see("beta", state(1.0), (sigma_m, 0.0), 0, is_flown=True)
    assert disc(around).reach_m == pytest.approx(0.4 + 0.02 + doubt_m)


def test_all_that_is_around_is_there_in_one_list():
    around = Surroundings(0.1, (Obstacle("lamp", (0.5, 0.4), 0.3), Obstacle("box", (-0.5, 0.0), 0.2)))
    around.see("beta", ControlState((1.0, 2.0), (0.1, -0.2), 0.3, 0.5), (0.0, 0.0), 0, is_flown=True)
    around.see("gamma", state(3.0), (0.0, 0.0), 0, is_flown=False)
    around.see("beta", ControlState((1.1, 2.0), (0.1, -0.2), 0.3, 0.5), (0.0, 0.0), 0, is_flown=True)
    found = around.discs((0.0, 0.0), 0, frozenset())
    assert [tuple(each) for each in found] == [
        ("beta", (1.1, 2.0), (0.1, -0.2), pytest.approx(0.22), 0.5),
        ("gamma", (3.0, 0.0), (0.0, 0.0), pytest.approx(0.22), 1.0),
        ("lamp", (0.5, 0.4), (0.0, 0.0), pytest.approx(0.42), 1.0),
        ("box", (-0.5, 0.0), (0.0, 0.0), pytest.approx(0.32), 1.0),
    ]
    assert TOUCH_RESERVE_M == 0.02
