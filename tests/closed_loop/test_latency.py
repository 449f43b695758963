"""The latency ledger of a flight: every stage has samples, and light grows older along the chain."""

import json
import math
from pathlib import Path

import pytest

from groundstation.launch.lockstep_run import run_lockstep
from groundstation.parts.operation.messages import Latency
from groundstation.recording.reader import Recording
from groundstation.rig.read import load_rig, read_text
from groundstation.watch.ledger import BYTES_TO_STATE, LIGHT, STAGES
from groundstation.watch.report import write_report

RIG = Path(__file__).parents[2] / "examples" / "rigs" / "late_pipeline.toml"
DELAY_S, LATE_S = 0.015, 0.6
FLOWN_S = 14.0


@pytest.mark.slow
def test_every_stage_of_a_flight_has_an_age_and_the_ages_ascend(tmp_path):
    recording = tmp_path / "run.mcap"
    run_lockstep(load_rig(RIG), read_text(RIG), RIG, recording, FLOWN_S, 4, lambda *_: None)
    with Recording(recording) as found:
        summaries = [message.payload for message in found.messages([Latency], ["alpha"])]
    assert len(summaries) == math.floor(FLOWN_S) - 1 or len(summaries) == math.floor(FLOWN_S)
    last = summaries[-1]
    assert last.stages == STAGES
    p50_s = dict(zip(last.stages, last.p50_s, strict=True))
    p99_s = dict(zip(last.stages, last.p99_s, strict=True))
    assert all(math.isfinite(p50_s[stage]) and p50_s[stage] <= p99_s[stage] for stage in STAGES)
    ages = [p50_s[stage] for stage in LIGHT]
    assert ages == sorted(ages)
    # what the rig says of each step: light, the picture's way, the spot finder
    assert p50_s["exposure"] == 0.0
    assert p50_s["arrival"] == pytest.approx(DELAY_S, abs=1e-4)
    assert p50_s["spots"] == pytest.approx(DELAY_S + LATE_S, abs=1e-4)
    assert p50_s["bus"] < DELAY_S + LATE_S + 0.1
    assert 0.0 <= p50_s[BYTES_TO_STATE] < 1e-3  # nodes take no time in lockstep

    write_report(recording, tmp_path / "report", lambda *_: None)
    reported = json.loads((tmp_path / "report" / "report.json").read_text())["vehicles"]["alpha"]
    for key, ages_s in (("latency_p50_ms", p50_s), ("latency_p99_ms", p99_s)):
        assert reported[key] == pytest.approx({name: 1e3 * age_s for name, age_s in ages_s.items()}, abs=1e-3)
