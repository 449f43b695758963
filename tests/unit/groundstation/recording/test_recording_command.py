"""``groundstation recording``: what it prints, and how it refuses."""

import pytest
from typer.testing import CliRunner

from groundstation.cli.main import call as command_line
from groundstation.cli.recording import app
from groundstation.declarations.errors import UsageError
from groundstation.parts.table import installed_tables
from groundstation.recording.info import RecordingInfo
from groundstation.recording.reader import Recording
from groundstation.recording.writer import Recorder


@pytest.fixture
def path(tmp_path, flight):
    info = RecordingInfo('name = "two mock-ups"\n', seed=7, calibration_sha256={"a.camera": "0123" * 16})
    with Recorder(tmp_path / "run.mcap", info) as recorder:
        for delivered in flight:
            recorder.record(delivered, delivered.envelope.publish_ns)
    return tmp_path / "run.mcap"


def call(*arguments):
    result = CliRunner().invoke(app, [str(a) for a in arguments])
    if isinstance(result.exception, UsageError):
        raise result.exception
    assert result.exit_code == 0, result.output
    return result.output


def test_info_names_rig_clock_and_every_topic(path):
    reported = call("info", path)
    assert "two mock-ups" in reported
    assert "clock: virtual; seed: 7" in reported
    assert "a.camera: sha256 0123012301230123" in reported
    row = next(line.split() for line in reported.splitlines() if line.startswith("imu_bytes"))
    assert row == ["imu_bytes", "alpha", "120", "100.0"]


def test_info_of_a_live_recording_names_the_date(tmp_path, flight):
    with Recorder(tmp_path / "live.mcap", RecordingInfo(utc_offset_ns=1_700_000_000 * 10**9)) as recorder:
        recorder.record(flight[0], 5)
    assert "2023-11-14 22:13:20 UTC" in call("info", tmp_path / "live.mcap")


def test_recover_takes_the_name_that_the_finished_file_would_have(tmp_path, path):
    torn = tmp_path / "torn.mcap.part"
    torn.write_bytes(path.read_bytes()[:-2000])
    reported = call("recover", torn)
    assert (tmp_path / "torn.mcap").exists()
    with Recording(tmp_path / "torn.mcap") as recording:
        assert f"{len(list(recording.messages(installed_tables().payloads.values())))} messages" in reported
    call("recover", torn)
    assert (tmp_path / "torn_recovered.mcap").exists()


def test_a_part_of_a_recording_is_refused_with_the_way_out(tmp_path, path):
    torn = tmp_path / "torn.mcap.part"
    torn.write_bytes(path.read_bytes()[:-2000])
    with pytest.raises(UsageError, match="groundstation recording recover"):
        call("info", torn)


@pytest.mark.parametrize("command", ["info", "recover"])
def test_what_is_no_recording_is_refused_in_one_sentence(tmp_path, command):
    (tmp_path / "x.mcap").write_text("no recording")
    with pytest.raises(UsageError, match="no MCAP file"):
        call(command, tmp_path / "x.mcap")
    with pytest.raises(UsageError, match="No such file"):
        call(command, tmp_path / "nothing.mcap")


def test_a_discarded_recording_leaves_nothing(tmp_path, flight):
    recorder = Recorder(tmp_path / "a.mcap", RecordingInfo())
    recorder.record(flight[0], 5)
    recorder.discard()
    recorder.discard()
    assert list(tmp_path.iterdir()) == []


def test_the_console_of_a_recording_without_a_rig_says_so(tmp_path, flight, capsys):
    with Recorder(tmp_path / "bare.mcap", RecordingInfo()) as recorder:
        recorder.record(flight[0], flight[0].envelope.publish_ns)
    assert command_line(["console", str(tmp_path / "bare.mcap")]) == 2
    assert capsys.readouterr().err.startswith(f"groundstation: {tmp_path / 'bare.mcap'} carries no rig: ")
