"""What people are shown of two sources of fixes: an event when the verdict changes, figures in the report."""

import math

import pytest

from groundstation.parts.overhead.gauges import ComparisonFigure
from groundstation.parts.overhead.messages import FixComparison
from groundstation.watch.monitor import Monitor


def pair(verdict, reason="", difference=(0.001, 0.0, 0.0), nis=3.0):
    sigma = (0.001, 0.001, 0.001)
    return FixComparison(7, "alpha", 0.01, difference, sigma, nis, 9, difference, nis, verdict, reason)


def test_an_event_says_when_sources_begin_to_disagree_and_when_they_agree_again(tables, delivered):
    monitor = Monitor(tables, ("alpha",))
    for number, compared in enumerate(
        [
            pair("too few"),
            pair("agree"),
            pair("disagree", "x by +5.90 mm"),
            pair("disagree", "x"),
            pair("agree"),
        ]
    ):
        monitor.take_delivered(delivered(compared, number), number)
    first, second = monitor.take_lines()
    assert first == "alpha: star fixes and overhead fixes disagree: x by +5.90 mm"
    assert second == "alpha: star fixes and overhead fixes agree"


def test_the_report_sums_the_pairs_up():
    figure = ComparisonFigure()
    assert figure.values() == {}
    figure.take(pair("agree"), 0.0)
    figure.take(pair("disagree", "y by +3.00 mm", (0.003, 0.0, math.radians(2)), 9.0), 1.0)
    summary = figure.values()["star_against_overhead"]
    assert summary["mean_mm_mm_deg"] == pytest.approx([2.0, 0.0, 1.0])
    assert summary["nis_over_3"] == pytest.approx(2.0)
    assert (summary["pairs"], summary["disagreed_ratio"]) == (2, 0.5)
    assert (summary["last_verdict"], summary["reason"]) == ("disagree", "y by +3.00 mm")
