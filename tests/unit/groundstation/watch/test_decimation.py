"""Fewer points draw the same picture: no extreme is lost, no gap is closed."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.parts.supervision.figures import first_and_last
from groundstation.parts.valves.pulses import impulse_ns, open_s
from groundstation.supervision.account import LONGEST_GAP_S, Account
from groundstation.watch.page.decimation import as_line, envelope, share, without_repeats


@given(seed=st.integers(0, 1000), count=st.integers(1, 3000), columns=st.integers(2, 300))
def test_least_and_largest_survive_and_there_are_few_points(seed, count, columns):
    rng = np.random.default_rng(seed)
    t, values = np.sort(rng.uniform(0.0, 10.0, count)), rng.normal(size=count)
    found = envelope(t, values, 0.0, 10.0, columns)
    assert np.nanmin(found.low) == values.min()
    assert np.nanmax(found.high) == values.max()
    assert np.isfinite(found.t).sum() <= columns or count <= columns
    drawn_t, drawn = as_line(found)
    assert {values.min(), values.max()} <= set(drawn)
    assert np.all(np.diff(drawn_t[np.isfinite(drawn_t)]) >= 0.0)


def test_a_single_spike_among_many_is_drawn_where_it_was():
    t, values = np.linspace(0.0, 600.0, 150_000), np.zeros(150_000)
    values[77_777] = 5.0
    found = envelope(t, values, 0.0, 600.0, 700)
    (at,) = np.flatnonzero(found.high == 5.0)
    assert found.t[at] == pytest.approx(t[77_777], abs=600.0 / 700)


def test_a_gap_breaks_the_line_however_many_points_there_are():
    for step in (0.5, 0.004):
        t = np.concatenate([np.arange(0.0, 40.0, step), np.arange(60.0, 100.0, step)])
        found = envelope(t, np.ones(len(t)), 0.0, 100.0, 200)
        (gap,) = np.flatnonzero(np.isnan(found.t))
        assert found.t[gap - 1] == pytest.approx(40.0, abs=0.51)
        assert found.t[gap + 1] == pytest.approx(60.0, abs=0.51)


def test_what_is_no_number_is_not_drawn_and_hides_nothing():
    t, values = np.linspace(0.0, 10.0, 1000), np.full(1000, np.nan)
    values[500] = 3.0
    found = envelope(t, values, 0.0, 10.0, 50)
    assert np.nansum(found.high) == 3.0


def test_a_way_that_stands_still_is_one_point_and_its_end():
    x = np.concatenate([np.zeros(50), np.linspace(0.0, 10.0, 1000), np.full(50, 10.0)])
    seen_x, _ = without_repeats(x, np.zeros(len(x)), 0.5)
    assert len(seen_x) == 22
    assert (seen_x[0], seen_x[-1]) == (0.0, 10.0)


def test_the_shares_of_all_columns_add_up_to_the_time_open():
    rng = np.random.default_rng(3)
    t = np.cumsum(rng.uniform(0.02, 0.5, 400))
    opened_s = rng.uniform(0.0, 0.02, 400)
    found = share(t, opened_s, 0.0, 200.0, 700)
    assert found.sum() * 200.0 / 700 == pytest.approx(opened_s.sum())
    assert share(np.array([1.0]), np.array([2.0]), 0.0, 4.0, 4).tolist() == [0.0, 1.0, 1.0, 0.0]


def test_a_pulse_lasts_until_its_time_is_over_or_the_next_command_replaces_it():
    t_s = np.array([0.0, 0.02, 0.04])
    on_time_s = np.array([[0.05, 0.0], [0.01, 0.02], [0.005, 0.0]])
    np.testing.assert_allclose(open_s(t_s, on_time_s), [[0.02, 0.0], [0.01, 0.02], [0.005, 0.0]])
    np.testing.assert_allclose(impulse_ns(t_s, on_time_s, 2.0), [0.04, 0.10, 0.11])


@given(st.lists(st.sampled_from([0.004, 0.1, 0.19, 0.21, 0.35, 2.0]), min_size=1, max_size=80))
def test_thinned_states_give_the_same_time_without_a_state(steps):
    t_s = 1.0 + np.cumsum(steps)

    def account_of(moments):
        account = Account()
        account.take_ruling(1.0, "flying", "", "", is_stop_latched=False)
        for moment in moments:
            account.take_state(float(moment), "flying")
        account.take_ruling(float(t_s[-1]) + LONGEST_GAP_S / 4, "landed", "", "", is_stop_latched=False)
        return account.time_without_state_s

    assert account_of(first_and_last(t_s)) == pytest.approx(account_of(t_s))
