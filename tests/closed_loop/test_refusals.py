"""The lights go out in flight: reason, picture and places of the stars are in the recording."""

from pathlib import Path

import cv2
import pytest
from typer.testing import CliRunner

from groundstation.bus.envelope import Delivered
from groundstation.cli.recording import app
from groundstation.declarations.errors import UsageError
from groundstation.launch.lockstep_run import run_lockstep
from groundstation.parts.stars.messages import StarFix, StarMatches
from groundstation.parts.table import installed_tables
from groundstation.recording.reader import Recording
from groundstation.rig.plan import make_node
from groundstation.rig.read import parse_rig
from groundstation.runners.replay import ReplayRunner
from groundstation.watch.monitor import Monitor

RIG = Path(__file__).parents[2] / "examples" / "rigs" / "published_condition.toml"
MORE = """
[mock_ups.standard.fusion]
rest_s = 1.0
[[laboratory.faults]]
kind = "dead_sky"
vehicle = "alpha"
start_s = 2.5
end_s = 4.0
"""


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    path = tmp_path_factory.mktemp("flown") / "run.mcap"
    text = RIG.read_text().replace("busy_s = 0.6", "busy_s = 0.2") + MORE
    rig_path = path.with_name("rig.toml")
    rig_path.write_text(text.replace("../../calibration", str(RIG.parents[2] / "calibration")))
    text = rig_path.read_text()
    run_lockstep(parse_rig(text, rig_path), text, rig_path, path, 4.5, 3, lambda *_: None)
    return path


@pytest.mark.slow
def test_the_pictures_of_refusals_are_recorded_shown_and_replayed(flown, tmp_path):
    out = tmp_path / "refused"
    result = CliRunner().invoke(app, ["pictures", str(flown), "--out", str(out), "--raw"])
    assert result.exit_code == 0, result.exception
    assert "no light spots" in result.stdout
    drawn = sorted(out.glob("alpha_*s.png"))
    assert len(drawn) == len(sorted(out.glob("*_raw.png"))) >= 2
    assert cv2.imread(str(drawn[0])).shape[1] == 2 * 640
    raw = cv2.imread(str(out / f"{drawn[0].stem}_raw.png"), cv2.IMREAD_UNCHANGED)
    assert raw.shape == (480, 640)
    tables = installed_tables()
    monitor = Monitor(tables, ("alpha",))
    with Recording(flown) as recording:
        rig = parse_rig(recording.info.rig_toml, Path(recording.info.rig_path))
        report = ReplayRunner(recording, lambda key: make_node(rig, key), ["alpha/star_tracker"]).run()
        assert report.agrees
        refused = 0
        for message in recording.messages(tables.payloads.values()):
            monitor.take_delivered(Delivered(message.envelope, message.payload), message.log_ns)
            refused += isinstance(message.payload, StarFix) and not message.payload.fix
        matches = [row.payload for row in recording.messages([StarMatches])]
    view = monitor.vehicles["alpha"]
    cells = dict(zip(view.labels(), view.rows(0), strict=True))
    assert cells["  refused"].text.rpartition("; ")[2] == f"{refused} x no light spots"
    assert matches[0].basis == "state"
    assert len(matches[0].stars) > 10


@pytest.mark.slow
def test_a_folder_for_pictures_is_not_made_for_a_recording_that_cannot_be_read(tmp_path):
    with pytest.raises(UsageError, match="cannot be opened"):
        CliRunner().invoke(
            app,
            ["pictures", str(tmp_path / "no.mcap"), "--out", str(tmp_path / "out")],
            catch_exceptions=False,
            standalone_mode=False,
        )
    assert not (tmp_path / "out").exists()
