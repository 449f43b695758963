"""How much later than usual samples arrive, from their arrivals and their stamps."""

import numpy as np
import pytest

from groundstation.fusion.hold_up import HoldUp

PERIOD_NS, USUAL_NS = 10_000_000, 12_000_000
SPREAD_S = 0.005


def followed(late_ns, spread_s=SPREAD_S):
    hold_up = HoldUp(spread_s)
    for count, late in enumerate(late_ns):
        hold_up.sample(count * PERIOD_NS + int(late), count * PERIOD_NS)
    return hold_up, (len(late_ns) - 1) * PERIOD_NS + int(late_ns[-1])


def test_nothing_is_known_before_the_first_sample():
    assert HoldUp(SPREAD_S).excess_s(10**12) == 0.0


@pytest.mark.parametrize("usual_ns", [0, USUAL_NS, 60_000_000, -3_000_000])
def test_a_steady_line_holds_nothing_up_however_long_it_is(usual_ns):
    rng = np.random.default_rng(1)
    hold_up, now_ns = followed(usual_ns + rng.uniform(0.0, 4e6, 3000))
    assert hold_up.excess_s(now_ns) == 0.0


def test_what_comes_later_by_more_than_the_spread_counts_whole_and_is_forgotten():
    hold_up, now_ns = followed([USUAL_NS] * 100 + [USUAL_NS + 80_000_000])
    assert hold_up.excess_s(now_ns) == pytest.approx(0.080, abs=1e-4)
    for count in range(109, 130):  # those that waited meanwhile came with it
        now_ns = count * PERIOD_NS + USUAL_NS
        hold_up.sample(now_ns, count * PERIOD_NS)
    assert hold_up.excess_s(now_ns) == 0.0


def test_a_sample_that_is_due_and_does_not_come_counts_as_late():
    hold_up, now_ns = followed([USUAL_NS] * 100)
    assert hold_up.excess_s(now_ns + PERIOD_NS) == 0.0
    assert hold_up.excess_s(now_ns + PERIOD_NS + 70_000_000) == pytest.approx(0.070, abs=1e-4)


def test_a_first_sample_that_was_held_up_does_not_set_what_is_usual():
    hold_up, now_ns = followed([USUAL_NS + 90_000_000] + [USUAL_NS] * 50 + [USUAL_NS + 50_000_000])
    assert hold_up.excess_s(now_ns) == pytest.approx(0.050, abs=1e-4)


def test_a_line_that_becomes_slower_for_good_is_usual_after_a_while():
    hold_up, now_ns = followed([USUAL_NS] * 100 + [USUAL_NS + 8_000_000] * 5000)
    assert hold_up.excess_s(now_ns) == 0.0


def test_samples_that_wait_for_the_timer_of_the_adapter_are_usual():
    """A timer of 16 ms delivers the samples of a span at its end."""
    stamps_ns = np.arange(3000) * 4_000_000
    arrivals_ns = (stamps_ns // 16_000_000 + 1) * 16_000_000 + 1_000_000
    hold_up = HoldUp(0.016 + 0.004)
    for arrived_ns, stamp_ns in zip(arrivals_ns.tolist(), stamps_ns.tolist(), strict=True):
        hold_up.sample(arrived_ns, stamp_ns)
        assert hold_up.excess_s(arrived_ns) == 0.0
