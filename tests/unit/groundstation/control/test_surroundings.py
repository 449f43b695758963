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
