"""A flight replayed with another delay of the camera: exposures move, arrivals stay."""

from pathlib import Path

import pytest

from groundstation.launch.lockstep_run import run_lockstep
from groundstation.parts.stars.messages import StarFix, StarSpots
from groundstation.recording.info import RecordingInfo
from groundstation.recording.reader import Recording
from groundstation.recording.writer import Recorder
from groundstation.rig.plan import make_node
from groundstation.rig.read import parse_rig
from groundstation.runners.replay import ReplayRunner

RIG = Path(__file__).parents[2] / "examples" / "rigs" / "late_pipeline.toml"
DELAY = "delay_s = 0.015\ndelay_sigma_s = 0.001"
OTHER = "delay_s = 0.011\ndelay_sigma_s = 0.001"
MOVED_NS = 4_000_000
NODES = ("alpha/spot_finder", "alpha/star_tracker")


def stamps_ns(recording, kind):
    """Stamps of the payloads of a class, by sequence number."""
    return {message.envelope.sequence: message.payload.stamp_ns for message in recording.messages([kind])}


@pytest.mark.slow
def test_exposures_move_by_the_difference_of_the_delays_and_arrivals_stay(tmp_path):
    text = (
        RIG.read_text()
        .replace("late_s = 0.6", "late_s = 0.05")
        .replace("[table]", '[record]\nimages = "lossless"\n\n[table]', 1)
    )
    text += "\n[mock_ups.standard.fusion]\nrest_s = 1.0\n"
    assert text.count(DELAY) == 1
    flown, replayed = tmp_path / "flown.mcap", tmp_path / "replayed.mcap"
    run_lockstep(parse_rig(text, RIG), text, RIG, flown, 3.0, 2, lambda *_: None)
    rig = parse_rig(text.replace(DELAY, OTHER), RIG)
    with Recording(flown) as recording, Recorder(replayed, RecordingInfo()) as output:
        report = ReplayRunner(recording, lambda key: make_node(rig, key), NODES, output=output).run()
    assert not report.missing_inputs
    of_noun = {result.noun: result for result in report.results}
    assert of_noun["star_spots"].agrees
    assert of_noun["star_fix"].different == sum(c.count for c in recording.channels if c.noun == "star_fix")
    assert of_noun["star_fix"].first.field == "stamp_ns"
    with Recording(flown) as before, Recording(replayed) as after:
        for kind, moved_ns in ((StarSpots, 0), (StarFix, MOVED_NS)):
            old, new = stamps_ns(before, kind), stamps_ns(after, kind)
            assert old.keys() <= new.keys()  # the last pictures were answered after the recording's end
            assert len(old) > 30
            assert {new[number] - old[number] for number in old} == {moved_ns}
        # what a fix calls its exposure is the arrival less the rig's delay
        arrivals, exposures = stamps_ns(before, StarSpots), stamps_ns(before, StarFix)
        assert {arrivals[number] - exposures[number] for number in exposures} == {15_000_000}
