"""Pictures that are put together from two are named, also where most are never looked into.

Of a camera that tears every picture only the first one holds rows that came before: the lower half of each is
that of an exposure whose own lower half nobody was given. Later ones are known by their stars, once it moves.
"""

import json

import pytest

from groundstation.parts.stars.messages import PictureTrouble, StarFix, StarSpots
from groundstation.parts.supervision.messages import Faults
from groundstation.supervision.faults import FAULTS

START_S, END_S = 6.0, 9.0
ROW = FAULTS["camera_torn"]
TORN = f"""
[[laboratory.failures]]
kind = "torn_camera"
vehicle = "alpha"
start_s = {START_S}
end_s = {END_S}
"""


def first_torn(flight):
    """The moment and the words of the first event."""
    rows = [row for row in flight.of(Faults) if "camera_torn" in row.ids]
    assert rows, flight.faults()
    return rows[0].stamp_ns * 1e-9, rows[0].details[rows[0].ids.index("camera_torn")]


@pytest.mark.slow
@pytest.mark.provokes("camera_torn")
@pytest.mark.parametrize("rig", ["published_condition", "late_pipeline"])
def test_a_torn_camera_is_named_at_once_by_who_sees_every_picture(fly, rig):
    flight = fly(TORN, rig=rig).run(START_S + 3.0)
    moment_s, words = first_torn(flight)
    assert START_S < moment_s < START_S + ROW.within_s
    assert words.startswith("torn picture: of rows 240 to 479")
    (trouble,) = flight.of(PictureTrouble)
    later = [spots.stamp_ns for spots in flight.of(StarSpots) if spots.stamp_ns >= trouble.stamp_ns]
    assert (
        moment_s < min(later) * 1e-9 + 0.6
    )  # before the tracker, busy or late by so much, could have said it
    answers = {fix.stamp_ns + 15_000_000: fix for fix in flight.of(StarFix)}
    if trouble.stamp_ns in answers:  # the busy one looks into another picture
        assert answers[trouble.stamp_ns].reason == trouble.reason
    assert flight.modes()[-1] == "flying"


@pytest.mark.slow
def test_torn_pictures_of_a_vehicle_that_moves_place_it_nowhere_else(fly):
    flight = fly(TORN, rig="late_pipeline", changes=[("late_s = 0.6", "late_s = 0.0")]).run(START_S - 3.0)
    flight.request("go_to", json.dumps({"x_m": 1.2, "y_m": 0.6, "heading_rad": 1.5}))
    flight.run(END_S + 5.0 - flight.runner.now_ns * 1e-9)
    torn = [fix for fix in flight.of(StarFix) if START_S + 0.1 < fix.stamp_ns * 1e-9 < END_S - 0.1]
    assert len(torn) > 30
    assert not any(fix.fix for fix in torn)
    assert {fix.reason.partition(":")[0] for fix in torn} == {"torn picture"}
    stands = [row.stamp_ns * 1e-9 for row in flight.of(Faults) if "camera_torn" in row.ids]
    assert min(stands) < START_S + ROW.within_s
    assert max(stands) > END_S  # without a break: it clears a second after the last one
    assert "wrong_fixes" not in flight.faults()
    assert "camera_torn" not in flight.of(Faults)[-1].ids
    assert any(fix.fix for fix in flight.of(StarFix, start_s=END_S + 0.5))
