"""What the live view says of fixes that there are not, and of the sky."""

import math

import pytest

from groundstation.bus.envelope import Delivered, Envelope
from groundstation.bus.topics import topic_of
from groundstation.cli.vehicle_rows import LABELS, line_of, rows_of
from groundstation.parts.stars.messages import SkyChange, StarFix
from groundstation.watch.monitor import Monitor

SECOND_NS = 1_000_000_000


@pytest.fixture
def monitor():
    return Monitor(("alpha",))


def tell(monitor, payload):
    topic = payload.TOPIC
    monitor.take(Delivered(Envelope(topic, "alpha", 1, payload.stamp_ns), payload), payload.stamp_ns)


def fix(second, reason=""):
    pose = (math.nan,) * 3 if reason else (1.0, 2.0, 0.5)
    return StarFix(second * SECOND_NS, "alpha", not reason, *pose, (0.0,) * 9, 0.0, 9, "tracking", reason)


def refused(monitor, second):
    vehicle = monitor.vehicles["alpha"]
    cell = rows_of(vehicle, second * SECOND_NS)[LABELS.index("  refused")].plain
    return cell, line_of(vehicle, second * SECOND_NS)


def test_the_present_reason_is_named_and_each_kind_is_counted(monitor):
    for second, reason in enumerate(
        ["", "too few stars: 3 spots", "no light spots: none", "too few stars: 2 spots"], start=1
    ):
        tell(monitor, fix(second, reason))
    cell, line = refused(monitor, 4)
    assert cell == "now: too few stars; 2 x too few stars, 1 x no light spots"
    assert line.endswith("no fix: too few stars (2 x)")


def test_with_a_fix_again_only_the_counts_remain(monitor):
    tell(monitor, fix(1, "too blurred: 9 spots"))
    tell(monitor, fix(2))
    cell, line = refused(monitor, 2)
    assert cell == "1 x too blurred"
    assert "no fix" not in line


@pytest.mark.parametrize(
    ("change", "star", "words"),
    [
        ("died", "7", "alpha: star 7 died at (1.000, 2.000) m, no longer used"),
        ("returned", "7", "alpha: star 7 returned at (1.000, 2.000) m, used again"),
        ("appeared", "", "a light that is no star appeared at (1.000, 2.000) m, proposed"),
    ],
)
def test_changes_of_the_sky_are_said_with_what_follows(monitor, change, star, words):
    tell(monitor, SkyChange(SECOND_NS, "alpha", change, star, 1.0, 2.0, (1e-8, 0.0, 1e-8), 25))
    (line,) = monitor.take_lines()
    assert words in line


def test_what_is_not_known_yet_is_a_dash(monitor):
    line = line_of(monitor.vehicles["alpha"], 0)
    assert "nan" not in line
    assert "inf" not in line
    assert "age    - s" in line
