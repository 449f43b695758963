"""Star fixes against overhead fixes: paired at one moment, judged over many."""

import numpy as np
import pytest

from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.overhead.fix_referee import FixReferee
from groundstation.parts.overhead.messages import OverheadFix
from groundstation.parts.stars.messages import StarFix
from groundstation.star_tracking.comparison import MIN_PAIRS

MS = 1_000_000
STD = (0.0005, 0.0005, 0.001)
COV = tuple(np.diag(np.square(STD)).ravel().tolist())
VELOCITY, RATE = (0.2, -0.1), 0.3


def pose(t_ms):
    t = t_ms * 1e-3
    return VELOCITY[0] * t, VELOCITY[1] * t, RATE * t


def state(t_ms):
    x, y, heading = pose(t_ms)
    return VehicleState(t_ms * MS, "alpha", (x, y), heading, VELOCITY, RATE, (1e-3, 1e-3, 1e-3), "flying", 0)


def star(t_ms, off):
    x, y, heading = np.add(pose(t_ms), off).tolist()
    return StarFix(t_ms * MS, "alpha", True, x, y, heading, COV, 0.0, 12, "tracking", "")


def above(t_ms, off):
    x, y, heading = np.add(pose(t_ms), off).tolist()
    return OverheadFix(t_ms * MS, "alpha", True, x, y, heading, COV, 0.0, 3, 3, 1e-4, "")


def referee_says(seed, bias=(0.0, 0.0, 0.0), star_delay_ms=600, until_ms=12_000):
    """Fly for a while: overhead fixes each 100 ms, 20 ms late; star fixes each 650 ms, much later."""
    rng = np.random.default_rng(seed)
    arrivals = [(t, state(t)) for t in range(0, until_ms, 10)]
    arrivals += [(t + 20, above(t, rng.normal(0, STD))) for t in range(37, until_ms, 100)]
    arrivals += [
        (t + star_delay_ms, star(t, rng.normal(0, STD) + np.array(bias))) for t in range(90, until_ms, 650)
    ]
    node = FixReferee("alpha", (0.0, 0.0), (0.0, 0.0))
    reported = []
    for t_ms, message in sorted(arrivals, key=lambda item: item[0]):
        reported += node.receive(message, t_ms * MS)
    return reported


@pytest.mark.parametrize("delay_ms", [5, 600])
def test_honest_sources_agree_and_their_differences_are_as_large_as_they_say(delay_ms):
    reported = [pair for seed in range(8) for pair in referee_says(seed, star_delay_ms=delay_ms)]
    assert len(reported) >= 8 * 16
    assert max(abs(pair.apart_s) for pair in reported) <= 0.05
    assert {pair.verdict for pair in reported} == {"too few", "agree"}
    assert 0.8 < np.mean([pair.nis for pair in reported]) / 3 < 1.25
    assert [pair.verdict for pair in reported if pair.pairs < MIN_PAIRS] == ["too few"] * (
        8 * (MIN_PAIRS - 1)
    )


@pytest.mark.parametrize(
    ("bias", "words"),
    [
        ((0.004, 0.0, 0.0), "x by +"),
        ((0.0, -0.004, 0.0), "y by -"),
        ((0.0, 0.0, 0.01), "heading by +"),
    ],
)
def test_a_source_that_is_off_is_named_by_what_is_off(bias, words):
    last = referee_says(3, bias)[-1]
    assert last.verdict == "disagree"
    assert last.reason.startswith(words)
    assert last.mean_difference == pytest.approx(bias, abs=0.0006)


def test_refusals_and_a_lost_filter_compare_nothing():
    node = FixReferee("alpha", (0.0, 0.0), (0.0, 0.0))
    nan = float("nan")
    none = OverheadFix(100 * MS, "alpha", False, nan, nan, nan, (nan,) * 9, 0.0, 0, 0, nan, "no circle")
    for message in (star(90, (0, 0, 0)), none, above(95, (0, 0, 0))):
        assert list(node.receive(message, 120 * MS)) == []  # no state has been heard
