"""A run has a folder: recording, rig, scenario, files of the rig, versions, notes, numbers and verdict."""

import hashlib
import json
from pathlib import Path

import pytest

from groundstation.cli.main import call
from groundstation.recording.info import RecordingInfo
from groundstation.recording.reader import Recording
from groundstation.recording.run_files import next_name, part_of, run_of
from groundstation.recording.writer import Recorder
from groundstation.rig.read import load_rig
from groundstation.watch.run_folder import new_run_folder

ROOT = Path(__file__).parents[4]
RIG = ROOT / "examples" / "rigs" / "drawn_fixes.toml"
SCENARIO = f"""
name = "Stay: 2 s / there"
rig = "{RIG}"
duration_s = 1.5
ready_s = 60.0
seed = 3
[[timeline]]
at_s = 0.5
mark = "half a second"
[[limits]]
what = "position_error_max_mm"
vehicle = "alpha"
below = 1000.0
"""


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """A folder with a scenario in it, and the folder of its run."""
    place = tmp_path_factory.mktemp("flown")
    (place / "stay.toml").write_text(SCENARIO)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        assert call(["run", "stay.toml", "--lockstep"]) == 0
    (folder,) = (place / "recordings").iterdir()
    return place, folder


def test_the_folder_of_a_run_holds_what_it_takes_to_understand_it(flown):
    place, folder = flown
    assert folder.name.endswith("_stay_2_s_there")
    assert sorted(path.name for path in folder.iterdir() if path.name != "files") == [
        "notes.md", "recording.mcap", "report.json", "rig.toml", "run.json", "scenario.toml",
    ]  # fmt: skip
    assert (folder / "scenario.toml").read_text() == (place / "stay.toml").read_text()
    with Recording(folder / "recording.mcap") as recording:
        assert (folder / "rig.toml").read_text() == recording.info.rig_toml
    report = json.loads((folder / "report.json").read_text())
    assert report["verdict"] == "passed"
    assert report["seed"] == 3
    assert [limit["what"] for limit in report["limits"]] == ["position_error_max_mm"]
    assert "alpha" in report["vehicles"]
    assert "half a second" in (folder / "notes.md").read_text()
    run = json.loads((folder / "run.json").read_text())
    assert {"groundstation", "python", "numpy"} <= set(run["versions"])
    for key, file in run["files"].items():
        (kept,) = (folder / "files").glob(f"{key}.*")
        assert hashlib.sha256(kept.read_bytes()).hexdigest() == file["sha256"]


def test_info_and_report_take_the_folder(flown, tmp_path, capsys):
    _, folder = flown
    assert call(["recording", "info", str(folder)]) == 0
    shown = capsys.readouterr().out
    assert "verdict: passed" in shown
    assert "note: 0.5 s: half a second" in shown
    assert "scenario.toml" in shown
    assert call(["report", str(folder), "--out", str(tmp_path / "report")]) == 0
    assert json.loads((tmp_path / "report" / "report.json").read_text())["recording"] == folder.name


def test_with_record_the_recording_goes_where_it_is_told_and_there_is_no_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = ["run", str(RIG), "--lockstep", "--duration", "0.5", "--record", str(tmp_path / "run.mcap")]
    assert call(words) == 0
    assert [path.name for path in tmp_path.iterdir()] == ["run.mcap"]


def test_a_run_that_is_refused_leaves_no_folder(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rig.toml").write_text(RIG.read_text().replace('name = "emulator"', 'name = "no_such_one"'))
    assert call(["run", str(tmp_path / "rig.toml"), "--lockstep", "--duration", "1"]) == 2
    capsys.readouterr()
    folder = tmp_path / "recordings"
    assert not folder.exists() or not list(folder.iterdir())


def test_what_somebody_put_into_the_folder_stays_though_nothing_was_recorded(tmp_path):
    folder = new_run_folder(tmp_path, "2026-03-01_12-00-00", "stay")
    folder.begin(load_rig(RIG), RIG.read_text(), SCENARIO)
    (folder.path / "lamp.txt").write_text("the third lamp flickers")
    assert not folder.discard_if_nothing_was_recorded()
    assert [path.name for path in folder.path.iterdir()] == ["lamp.txt"]
    (folder.path / "lamp.txt").unlink()
    assert folder.discard_if_nothing_was_recorded()
    assert list(tmp_path.iterdir()) == []


def test_a_name_that_is_taken_gets_a_number(tmp_path):
    first = new_run_folder(tmp_path, "2026-03-01_12-00-00", "two mock-ups")
    first.path.mkdir()
    assert first.path.name == "2026-03-01_12-00-00_two_mock_ups"
    assert new_run_folder(tmp_path, "2026-03-01_12-00-00", "two mock-ups").path.name.endswith("_ups_2")
    assert new_run_folder(tmp_path, "2026-03-01_12-00-00", "  ").path.name.endswith("_run")


def test_files_of_a_run_come_in_the_order_of_their_numbers(tmp_path):
    first = tmp_path / "run.mcap"
    for name in ("run.mcap", "run_10.mcap", "run_2.mcap", "run_3.mcap.part", "run_x.mcap", "running.mcap"):
        (tmp_path / name).touch()
    finished, torn = run_of(first)
    assert [path.name for path in finished] == ["run.mcap", "run_2.mcap", "run_10.mcap"]
    assert [path.name for path in torn] == ["run_3.mcap.part"]
    assert next_name(first).name == "run_1.mcap"
    assert part_of(first).name == "run.mcap.part"


def test_a_folder_without_a_recording_is_refused(tmp_path, capsys):
    assert call(["recording", "info", str(tmp_path)]) == 2
    assert "holds no recording.mcap" in capsys.readouterr().err
    recorder = Recorder(tmp_path / "recording.mcap", RecordingInfo())
    assert call(["recording", "info", str(tmp_path)]) == 2
    assert "groundstation recording recover" in capsys.readouterr().err
    recorder.discard()
