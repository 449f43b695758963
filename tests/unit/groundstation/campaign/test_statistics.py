"""Pass rates and what drives failures, with published and hand-made values."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.campaign.errors import CampaignError
from groundstation.campaign.flying import written
from groundstation.campaign.plan import Plan, Sweep, parse_sweep
from groundstation.campaign.statistics import LimitRuns, wilson, worst_of


@pytest.mark.parametrize(
    ("passed", "count", "low", "high"),
    [  # Newcombe, Stat. Med. 17 (1998), Table I, method 3
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_the_interval_is_wilsons(passed, count, low, high):
    assert wilson(passed, count) == (pytest.approx(low, abs=6e-5), pytest.approx(high, abs=6e-5))


@given(st.integers(1, 10_000).flatmap(lambda count: st.tuples(st.integers(0, count), st.just(count))))
def test_the_interval_holds_the_share_and_lies_in_0_to_1(given_counts):
    passed, count = given_counts
    low, high = wilson(passed, count)
    assert 0.0 <= low <= passed / count + 1e-12
    assert passed / count - 1e-12 <= high <= 1.0


def limit(values, below=None, above=None):
    return LimitRuns("alpha: x_mm", below, above, np.array(values, float))


def test_limits_hold_or_not_and_the_unknown_does_not():
    found = limit([1.0, 3.0, math.nan, math.inf, -1.0], below=2.0, above=0.0)
    assert found.held.tolist() == [True, False, False, False, False]
    assert found.overrun().tolist()[:2] == [0.0, 0.5]


def test_the_worst_are_those_farthest_beyond_their_limits():
    rows = [{"run": str(n), "verdict": "failed" if n != 1 else "passed"} for n in range(4)]
    found = worst_of(rows, [limit([3.0, 9.0, 5.0, math.nan], below=2.0)], 2)
    assert [row["run"] for row in found] == ["3", "2"]


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.1, "0.1"), (math.nan, ""), (math.inf, "inf"), (3, "3"), (True, "true"), ("path", "path"),
     (1 / 3, "0.333333333")],
)  # fmt: skip
def test_values_are_written_so(value, text):
    assert written(value) == text


def test_a_sweep_takes_its_values_in_turn():
    sweep = parse_sweep("laboratory.alpha.mass_kg=10:12:3")
    assert sweep == Sweep("laboratory.alpha.mass_kg", (10.0, 11.0, 12.0))
    assert Plan(4, 1, sweep).count == 12


@pytest.mark.parametrize(
    "text", ["", "a", "a=1", "a=1:2", "a=1:2:0", "a=1:2:x", "=1:2:3", "a=nan:2:3", "a=1:2:3:4"]
)
def test_a_sweep_that_is_none_is_refused(text):
    with pytest.raises(CampaignError, match="expected key=first:last:number"):
        parse_sweep(text)
