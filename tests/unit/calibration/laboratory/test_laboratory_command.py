"""`calibrate laboratory` on recordings that do not suffice: one sentence, exit code 2, nothing written."""

import json
from pathlib import Path

import pytest

from groundstation.declarations.errors import UsageError
from groundstation.declarations.request import Request
from groundstation.recording.errors import RecordingError
from groundstation.recording.writer import Recorder
from groundstation.rig.provenance import recording_info
from groundstation.rig.read import parse_rig
from groundstation.runners.make_runner import make_runner

RIG = Path(__file__).parents[4] / "examples" / "rigs" / "drawn_fixes.toml"


def record(path, seconds, text, requests=()):
    rig = parse_rig(text, RIG)
    recorder = Recorder(path, recording_info(rig, text, RIG, 1, utc_offset_ns=None))
    runner = make_runner(rig, 1, [recorder.record], requests=requests)
    try:
        runner.run(round(seconds * 1e9))
    finally:
        runner.close()
    recorder.finish()
    return path


@pytest.fixture(scope="module")
def rest(tmp_path_factory):
    """Two seconds on the ground."""
    return record(tmp_path_factory.mktemp("rest") / "rest.mcap", 2.0, RIG.read_text())


@pytest.fixture
def run(groundstation, tmp_path):
    return lambda *words: groundstation("calibrate", "laboratory", *words, "--out", tmp_path / "lab.toml")


def refused(run, words, tmp_path, kind=UsageError):
    before = sorted(tmp_path.iterdir())
    with pytest.raises(kind) as caught:
        run(*words)
    assert sorted(tmp_path.iterdir()) == before
    return str(caught.value)


def test_a_recording_without_flight_is_refused(run, rest, tmp_path):
    assert "alpha never floated: nothing was flown" in refused(run, [rest], tmp_path)


def test_a_vehicle_that_is_not_there_is_refused(run, rest, tmp_path):
    assert "has no vehicle 'gamma'; there are alpha" in refused(run, [rest, "--vehicle", "gamma"], tmp_path)


def test_a_float_without_valve_commands_is_refused(run, tmp_path):
    text = RIG.read_text().replace(
        'mock_up = "standard"\n', 'mock_up = "standard"\nstarts_by_itself = false\n', 1
    )
    asked = [Request(1_000_000_000, "alpha", 1, "test", "float_on", json.dumps({}))]
    path = record(tmp_path / "float.mcap", 3.0, text, asked)
    assert "no valve of alpha was ever commanded to open" in refused(run, [path], tmp_path)


def test_a_recording_of_a_killed_recorder_is_refused(run, rest, tmp_path):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(rest.read_bytes()[:-20_000])
    assert "recording recover" in refused(run, [cut], tmp_path, RecordingError)


def test_what_is_no_recording_is_refused(run, tmp_path):
    text = tmp_path / "notes.mcap"
    text.write_text("not a recording\n")
    assert "is no MCAP file" in refused(run, [text], tmp_path, RecordingError)
    folder = tmp_path / "folder"
    folder.mkdir()
    assert "is a folder" in refused(run, [folder], tmp_path)
    assert "cannot be opened" in refused(run, [tmp_path / "none.mcap"], tmp_path, RecordingError)
