"""Stamps of every wild kind: the outlier is set aside, its neighbours stay."""

import numpy as np
import pytest

from groundstation.fusion.stamp_screen import BEHIND, FAR, NOT_FINITE, screen_stamps

PERIOD_S = 0.01
N = 3000


@pytest.fixture
def clock():
    return np.arange(1, N + 1) * PERIOD_S + np.random.default_rng(1).normal(0.0, 2e-4, N)


def kept(found):
    return np.isfinite(found.stamp_s)


@pytest.mark.parametrize("rows", [[0], [-1], [1500], [1500, 1501], [0, 1], [-2, -1], [10, 900, 2000]])
@pytest.mark.parametrize("off_s", [10.0, 60.0, 600.0, 1e5, 1.76e9, 1e300, -10.0, -1e6, -1e300])
def test_wild_stamps_are_set_aside_and_no_other(clock, rows, off_s):
    given = clock.copy()
    given[rows] += off_s
    found = screen_stamps(given, PERIOD_S)
    want = np.ones(N, bool)
    want[rows] = False
    np.testing.assert_array_equal(kept(found), want)
    np.testing.assert_array_equal(found.stamp_s[want], clock[want])
    assert len(found.aside[FAR]) == len(rows)


@pytest.mark.parametrize("wild", [np.nan, np.inf, -np.inf])
def test_what_is_no_number_is_named_so(clock, wild):
    clock[7] = wild
    found = screen_stamps(clock, PERIOD_S)
    assert found.aside[NOT_FINITE].tolist() == [7]
    assert kept(found).sum() == N - 1


@pytest.mark.parametrize("gap_s", [0.03, 3.0, 20.0, 40_000.0, 1.76e9])
def test_a_pause_is_a_pause(clock, gap_s):
    clock[1500:] += gap_s
    found = screen_stamps(clock, PERIOD_S)
    np.testing.assert_array_equal(found.stamp_s, clock)
    clock[1499] += 0.5 * gap_s + 5.0  # and one before it is wild
    assert kept(screen_stamps(clock, PERIOD_S)).sum() >= N - 1


def test_swapped_equal_and_doubled_rows_cost_themselves_only(clock):
    swapped, equal = clock.copy(), clock.copy()
    swapped[[500, 501]] = clock[[501, 500]]
    equal[700:703] = equal[700]
    assert kept(screen_stamps(swapped, PERIOD_S)).sum() == N - 1
    assert kept(screen_stamps(equal, PERIOD_S)).sum() == N - 2
    doubled = screen_stamps(np.repeat(clock, 2), PERIOD_S)
    np.testing.assert_array_equal(doubled.stamp_s[kept(doubled)], clock)
    assert len(doubled.aside[BEHIND]) == N


@pytest.mark.parametrize("back_s", [1.0, 4.0, 10.0, 1e6])
def test_seconds_are_counted_on_when_a_clock_is_set_back(clock, back_s):
    given = clock.copy()
    given[1500:] -= back_s
    given[100] = 1e9
    found = screen_stamps(given, PERIOD_S)
    assert [row for row, _ in found.set_back] == [1500]
    good = kept(found)
    assert good.sum() == N - 1
    np.testing.assert_allclose(found.stamp_s[good], clock[good], atol=1e-3)


def test_many_wild_stamps_are_all_found(clock):
    rng = np.random.default_rng(2)
    rows = rng.choice(N, 60, replace=False)
    given = clock.copy()
    given[rows] += rng.choice([-1.0, 1.0], 60) * rng.uniform(2.0, 1e6, 60)
    found = screen_stamps(given, PERIOD_S)
    assert set(np.flatnonzero(~kept(found))) == set(rows)


@pytest.mark.parametrize("off_s", [100.0, -100.0, 8.0, -8.0, 1e6, -1e9])
@pytest.mark.parametrize("rows", [3, 21, 30, 300])
@pytest.mark.parametrize("at", [400, 1500, 2600])
def test_an_island_of_stamps_that_goes_back_is_set_aside_alone(clock, off_s, rows, at):
    given = clock.copy()
    given[at : at + rows] += off_s
    found = screen_stamps(given, PERIOD_S)
    want = np.ones(N, bool)
    want[at : at + rows] = False
    np.testing.assert_array_equal(kept(found), want)
    np.testing.assert_array_equal(found.stamp_s[want], clock[want])
    assert len(found.aside[FAR]) == rows
    assert not found.set_back


def test_islands_with_wild_stamps_in_them_and_losses_around_them_are_set_aside(clock):
    given = clock.copy()
    given[500:530] += 100.0
    given[510] = -7e4
    given[2000:2040] -= 100.0
    given = np.delete(given, [499, 515, 516, 530, 2040])
    found = screen_stamps(given, PERIOD_S)
    assert kept(found).sum() == N - 30 - 40 - 3
    assert not found.set_back


def test_a_clock_that_is_set_back_for_good_after_a_pause_is_no_island(clock):
    given = clock.copy()
    given[1500:] += 100.0
    given[1540:] -= 30.0
    found = screen_stamps(given, PERIOD_S)
    assert kept(found).all()
    assert [row for row, _ in found.set_back] == [1540]


@pytest.mark.parametrize("given", [[], [1.0], [np.nan] * 30, [5.0] * 30])
def test_next_to_nothing_is_no_trouble(given):
    assert kept(screen_stamps(np.array(given), PERIOD_S)).sum() <= 1


@pytest.mark.parametrize("rows", [3, 10, 19, 20, 25, 300, 1400])
@pytest.mark.parametrize("off_s", [0.5, 10.0, 1e5, 1.76e9, -0.5, -10.0, -1e6])
def test_a_stretch_of_wild_stamps_from_which_the_clock_comes_back_is_set_aside_and_no_other(
    clock, rows, off_s
):
    given = clock.copy()
    given[1000 : 1000 + rows] += off_s
    found = screen_stamps(given, PERIOD_S)
    want = np.ones(N, bool)
    want[1000 : 1000 + rows] = False
    np.testing.assert_array_equal(kept(found), want)
    np.testing.assert_array_equal(found.stamp_s[want], clock[want])
    assert found.set_back == ()


def test_stretches_one_after_the_other_and_with_wild_stamps_inside_are_all_set_aside(clock):
    given = clock.copy()
    for first, rows, off_s in ((100, 50, 1e4), (400, 30, -60.0), (2000, 200, 3.0)):
        given[first : first + rows] += off_s
    given[[410, 2050, 2051]] += 1e6
    found = screen_stamps(given, PERIOD_S)
    assert N - kept(found).sum() == 280
    np.testing.assert_array_equal(found.stamp_s[kept(found)], clock[kept(found)])
