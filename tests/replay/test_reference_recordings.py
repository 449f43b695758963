"""Committed recordings, one per kind of rig, replayed through today's nodes; how to renew one is in
``docs/how_to/replay.md``."""

import hashlib
import re
import runpy
import shutil
import sys
import tomllib
from dataclasses import make_dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import pytest

from groundstation.bus.cdr import codec_of, ros_fields
from groundstation.declarations.errors import UsageError
from groundstation.declarations.message import Message
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.laboratory.messages import InjectedFailure
from groundstation.parts.table import installed_tables
from groundstation.recording.reader import Recording
from groundstation.recording.writer import Recorder
from groundstation.rig.plan import make_node
from groundstation.rig.provenance import changed_files, recorded_rig
from groundstation.rig.read import files_of
from groundstation.rig.variation import varied
from groundstation.runners.replay import ReplayRunner
from groundstation.runners.tolerances import load_tolerances

FOLDER = Path(__file__).parent
ROOT = FOLDER.parents[1]
PAYLOADS = installed_tables().payloads
KINDS = tomllib.loads((FOLDER / "kinds.toml").read_text())
TOLERANCES = load_tolerances(FOLDER / "tolerances.toml", PAYLOADS)
MOST_BYTES = 3_000_000  # of all recordings: they stay in the history for good
FOLDERS_OF_MACHINES = re.compile(rb"(?<![\w.])/(home|Users|root|tmp|var|work|mnt)/")
ADVICE = "meant? then python tools/renew_recordings.py {} --reason '...'"


def recording_of(kind):
    return FOLDER / "recordings" / f"{kind}.mcap"


def replayed(path, changes=None):
    """Report of the replay, sentences on files that have changed since."""
    with Recording(path) as recording:
        rig = recorded_rig(recording)
        sentences = changed_files(rig, recording.info)
        rig = varied(rig, changes) if changes else rig
        report = ReplayRunner(recording, lambda key: make_node(rig, key), tolerances=TOLERANCES).run()
        return report, sentences


@pytest.mark.parametrize("kind", KINDS)
def test_todays_nodes_publish_what_was_recorded(kind):
    report, sentences = replayed(recording_of(kind))
    assert report.agrees, "\n".join([*sentences, *report.differences(), ADVICE.format(kind)])
    nouns = {result.noun for result in report.results if result.equal + result.close}
    assert {"state", "wrench", "valve_demand", "valve_command", "fix_account"} <= nouns


@pytest.mark.parametrize("kind", KINDS)
def test_a_changed_parameter_is_found_with_topic_field_sequence_and_difference(kind):
    report, _ = replayed(recording_of(kind), KINDS[kind]["changed"])
    assert not report.agrees
    found = r"^\w+/\w+: \d+ different, .*first difference in \w+: recorded .*, replayed .*apart, sequence \d+"
    assert any(re.search(found, sentence) for sentence in report.differences()), report.differences()


def test_every_recording_has_a_kind_and_they_are_small():
    present = sorted(path.stem for path in (FOLDER / "recordings").iterdir())
    assert present == sorted(KINDS)
    assert sum(recording_of(kind).stat().st_size for kind in KINDS) < MOST_BYTES


@pytest.mark.parametrize("kind", KINDS)
def test_the_last_reason_is_that_of_the_recording(kind):
    renewals = tomllib.loads((FOLDER / "renewals.toml").read_text())["renewal"]
    last = [entry for entry in renewals if entry["kind"] == kind][-1]
    assert last["sha256"] == hashlib.sha256(recording_of(kind).read_bytes()).hexdigest()
    assert last["reason"].strip()
    with Recording(recording_of(kind)) as recording:
        assert recording.info.software == last["software"]
        assert recording.info.rig_toml.endswith(KINDS[kind]["added"])
        failures = [message.payload.failure for message in recording.messages([InjectedFailure])]
    assert failures


@pytest.mark.parametrize("kind", KINDS)
def test_a_recording_names_no_folder_of_the_machine_that_made_it(kind):
    with Recording(recording_of(kind)) as recording:
        assert recording.info.rig_path == KINDS[kind]["rig"]
        texts = [repr(recording.info.to_metadata()).encode()]
        texts += [message.data for message in recording.messages(PAYLOADS.values())]
    for text in texts:
        assert not FOLDERS_OF_MACHINES.search(text), text
        assert str(ROOT).encode() not in text


@pytest.fixture
def elsewhere(tmp_path, monkeypatch):
    """Another copy of the project, as much of it as a replay needs, seen from a folder outside."""
    copy, outside = tmp_path / "copy", tmp_path / "outside"
    shutil.copytree(FOLDER / "recordings", copy / "tests" / "replay" / "recordings")
    shutil.copytree(ROOT / "calibration" / "rigs", copy / "calibration" / "rigs")
    (copy / "examples" / "rigs").mkdir(parents=True)
    outside.mkdir()
    monkeypatch.chdir(outside)
    return copy


@pytest.mark.parametrize("kind", ["star_cameras", "drawn_fixes"])
def test_a_recording_is_replayed_from_another_copy_of_the_project(elsewhere, kind):
    path = elsewhere / "tests" / "replay" / "recordings" / f"{kind}.mcap"
    with Recording(path) as recording:
        used = files_of(recorded_rig(recording)).values()
    assert all(elsewhere in file.path.parents for file in used)
    report, sentences = replayed(path)
    assert report.agrees, report.differences()
    assert sentences == []


def test_a_calibration_file_that_has_changed_is_told_in_a_sentence(elsewhere, groundstation):
    path = elsewhere / "tests" / "replay" / "recordings" / "star_cameras.mcap"
    ceiling = elsewhere / "calibration" / "rigs" / "emulated" / "ceiling.csv"
    rows = ceiling.read_text().splitlines()
    ceiling.write_text("\n".join(rows[:-20]) + "\n")
    result = groundstation("replay", path)
    assert result.exit_code == 1
    said = " ".join(result.output.split())
    assert "mock_ups.standard.star_camera.ceiling is not the one of the recording: ceiling.csv" in said
    assert "star_fix" in said


def test_the_copy_whose_files_are_those_of_the_recording_is_taken(elsewhere, monkeypatch):
    other = elsewhere.parent / "other"
    shutil.copytree(elsewhere, other)
    ceiling = other / "calibration" / "rigs" / "emulated" / "ceiling.csv"
    ceiling.write_text(ceiling.read_text() + "\n")
    monkeypatch.chdir(other)
    path = elsewhere / "tests" / "replay" / "recordings" / "star_cameras.mcap"
    with Recording(path) as recording:
        rig = recorded_rig(recording)
        assert changed_files(rig, recording.info) == []
    assert all(elsewhere in file.path.parents for file in files_of(rig).values())


def test_a_calibration_file_that_is_nowhere_is_refused_by_its_name(elsewhere, groundstation):
    (elsewhere / "calibration" / "rigs" / "emulated" / "ceiling.csv").unlink()
    with pytest.raises(UsageError, match=r"ceiling\.csv: cannot be read"):
        groundstation("replay", elsewhere / "tests" / "replay" / "recordings" / "star_cameras.mcap")


def with_state_of(columns, tmp_path):
    """Three seconds of a reference recording whose states were recorded with other fields."""
    annotated = [(name, Annotated[Any, ros_type]) for name, ros_type in columns]
    kind = make_dataclass(
        "VehicleState",
        annotated,
        bases=(Message,),
        frozen=True,
        namespace={"TOPIC": VehicleState.TOPIC, "ROS_TYPE": VehicleState.ROS_TYPE},
    )
    path = tmp_path / "old.mcap"
    with Recording(recording_of("drawn_fixes")) as then, Recorder(path, then.info) as recorder:
        for message in then.messages(PAYLOADS.values(), stop_ns=then.start_ns + 3_000_000_000):
            envelope, data = message.envelope, message.data
            written = PAYLOADS[envelope.topic.noun]
            if written is VehicleState:
                state, written = message.payload, kind
                values = {name: getattr(state, name, 0.0) for name, _ in columns}
                data = codec_of(kind).encode(kind(state.stamp_ns, state.vehicle, **values))
            recorder.record_encoded(written, envelope, data, message.log_ns)
    return path


def test_a_recording_that_lacks_a_field_of_today_is_refused_in_a_sentence(tmp_path, groundstation):
    *columns, (lacking, _) = ros_fields(VehicleState)
    with pytest.raises(UsageError, match=f"/alpha/state was recorded without the field '{lacking}'"):
        groundstation("replay", with_state_of(columns, tmp_path))


def test_a_recording_with_a_field_that_is_gone_today_is_read(tmp_path, groundstation):
    columns = [("altitude_m", "float64"), *ros_fields(VehicleState)]
    path = with_state_of(columns, tmp_path)
    result = groundstation("replay", path, "--tolerances", FOLDER / "tolerances.toml")
    assert result.exit_code == 0, result.output
    assert "all agrees" in result.output
    assert re.search(r"^state +alpha +\d{2}", result.output, re.MULTILINE)


@pytest.fixture
def renew(tmp_path, monkeypatch):
    """The command, for a folder with one short kind."""
    monkeypatch.chdir(tmp_path)  # the command changes it
    folder = tmp_path / "replay"
    folder.mkdir()
    shutil.copy(FOLDER / "tolerances.toml", folder)
    (folder / "kinds.toml").write_text(
        '[drawn]\nrig = "examples/rigs/drawn_fixes.toml"\nduration_s = 0.5\nseed = 1\nadded = ""\n'
    )

    def call(*words):
        tool = ROOT / "tools" / "renew_recordings.py"
        monkeypatch.setattr(sys, "argv", [str(tool), *words, "--folder", str(folder)])
        runpy.run_path(str(tool), run_name="__main__")
        return tomllib.loads((folder / "renewals.toml").read_text())["renewal"]

    call.folder = folder
    return call


def test_a_renewal_is_appended_with_its_reason(renew):
    (first,) = renew("--all", "--reason", 'the "first"')
    assert first["reason"] == 'the "first"'
    kinds = renew.folder / "kinds.toml"
    kinds.write_text(kinds.read_text().replace("seed = 1", "seed = 2"))
    entries = renew("drawn", "--reason", "another seed")
    assert [entry["reason"] for entry in entries] == ['the "first"', "another seed"]
    path = renew.folder / "recordings" / "drawn.mcap"
    assert entries[-1]["sha256"] == hashlib.sha256(path.read_bytes()).hexdigest() != first["sha256"]
    with Recording(path) as recording:
        assert recording.info.rig_path == "examples/rigs/drawn_fixes.toml"
        assert recording.info.seed == 2


def test_a_renewal_names_the_topics_in_which_the_recording_before_differed(renew):
    renew("--all", "--reason", "first")
    with Recording(recording_of("drawn_fixes")) as then:
        text = then.info.rig_toml
    changed = text.replace("gyro_density_rad_s_rthz = 6.7e-5", "gyro_density_rad_s_rthz = 1e-3")
    assert changed != text
    path = renew.folder / "recordings" / "drawn.mcap"
    shutil.copy(recording_of("drawn_fixes"), path)
    rewritten = path.with_name("rewritten.mcap")
    with Recording(path) as then, Recorder(rewritten, replace(then.info, rig_toml=changed)) as recorder:
        for message in then.messages(PAYLOADS.values()):
            kind = PAYLOADS[message.envelope.topic.noun]
            recorder.record_encoded(kind, message.envelope, message.data, message.log_ns)
    rewritten.replace(path)
    assert "alpha/state" in renew("drawn", "--reason", "second")[-1]["changed_topics"]


@pytest.mark.parametrize(
    "words",
    [
        ("--all",),
        ("--all", "--reason", "  "),
        ("--reason", "no kind"),
        ("darwn", "--reason", "misspelt"),
        ("--all", "drawn", "--reason", "both"),
    ],
)
def test_a_renewal_without_a_reason_or_a_kind_is_refused(renew, words, capsys):
    with pytest.raises(SystemExit) as refused:
        renew(*words)
    assert refused.value.code == 2
    assert "error: " in capsys.readouterr().err
    assert not (renew.folder / "renewals.toml").exists()
