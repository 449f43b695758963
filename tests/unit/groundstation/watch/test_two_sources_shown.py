"""What people are told of two sources of fixes: a line when the verdict changes, figures in the report."""

import math

import pytest

from groundstation.bus.envelope import Delivered, Envelope
from groundstation.bus.topics import topic_of
from groundstation.parts.overhead.messages import FixComparison
from groundstation.watch.monitor import Monitor
from groundstation.watch.report import compared


def pair(verdict, reason="", difference=(0.001, 0.0, 0.0), nis=3.0):
    std = (0.001, 0.001, 0.001)
    return FixComparison(7, "alpha", 0.01, difference, std, nis, 9, difference, nis, verdict, reason)


def test_the_view_speaks_when_sources_begin_to_disagree_and_when_they_agree_again():
    monitor, topic = Monitor(("alpha",)), FixComparison.TOPIC
    for number, said in enumerate(
        [
            pair("too few"),
            pair("agree"),
            pair("disagree", "x by +5.90 mm"),
            pair("disagree", "x"),
            pair("agree"),
        ]
    ):
        monitor.take(Delivered(Envelope(topic, "alpha", number, number), said), number)
    first, second = monitor.take_lines()
    assert first == "alpha: star fixes and overhead fixes disagree: x by +5.90 mm"
    assert second == "alpha: star fixes and overhead fixes agree"


def test_the_report_sums_the_pairs_up():
    summary = compared([pair("agree"), pair("disagree", "y by +3.00 mm", (0.003, 0.0, math.radians(2)), 9.0)])
    assert summary["mean_mm_mm_deg"] == pytest.approx([2.0, 0.0, 1.0])
    assert summary["nis_over_3"] == pytest.approx(2.0)
    assert (summary["pairs"], summary["disagreed_ratio"]) == (2, 0.5)
    assert (summary["last_verdict"], summary["reason"]) == ("disagree", "y by +3.00 mm")
