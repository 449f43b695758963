"""A flight with a table map and a calibrated IMU says so in its recording and is replayed bit for bit."""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from calibration.result import CalibrationResult, Provenance, Quantity
from calibration.table.smoothed_flights import read_source
from groundstation.fusion.table_map import MapProvenance, TableMap
from groundstation.launch.lockstep_run import run_lockstep
from groundstation.parts.fusion.messages import FusionCalibration
from groundstation.recording.reader import Recording
from groundstation.rig.plan import make_node
from groundstation.rig.read import load_rig, parse_rig, read_text
from groundstation.runners.replay import ReplayRunner

RIGS = Path(__file__).parents[2] / "examples" / "rigs"
NOON = datetime(2026, 1, 1, 12, tzinfo=UTC)


def write_map(path, pull_m_s2):
    flat = np.ones((7, 9))
    sigma = 1e-4 * flat
    TableMap(
        -2.0, -1.5, 0.5, pull_m_s2 * flat, -1e-3 * flat, sigma, sigma, 0.0 * flat, (pull_m_s2, -1e-3),
        1e-9 * np.eye(2), 1e-3, MapProvenance(NOON, {"laps.mcap": "0" * 64}, 1.0, 300.0),
    ).save(path)  # fmt: skip


def replayed(path):
    with Recording(path) as recording:
        rig = parse_rig(recording.info.rig_toml, Path(recording.info.rig_path))
        found = [row.payload for row in recording.messages((FusionCalibration,), ("alpha",))]
        return found, recording.info, ReplayRunner(recording, lambda key: make_node(rig, key)).run()


def test_files_in_use_are_recorded_and_replay_is_exact_until_they_change(tmp_path):
    scale = {"gyro_scale": Quantity(2e-3, 1e-4, "1")}
    imu, table_map = tmp_path / "imu.toml", tmp_path / "map.toml"
    imu.write_text(CalibrationResult("test", Provenance("r.mcap", "0" * 64, NOON), scale).to_toml())
    write_map(table_map, 3e-3)
    text = (RIGS / "drawn_fixes.toml").read_text()
    legs = "legs = { A = [-1.8, -1.3], B = [1.8, -1.3], C = [0.0, 1.3] }"
    text = text.replace("y_max_m = 1.5", f'y_max_m = 1.5\nmap = "map.toml"\n{legs}')
    text = text.replace("baud = 250000", 'baud = 250000\ncalibration = ["imu.toml"]')
    rig_path, path = tmp_path / "rig.toml", tmp_path / "run.mcap"
    rig_path.write_text(text + "\n[mock_ups.standard.fusion]\nrest_s = 1.0\n")
    run_lockstep(load_rig(rig_path), read_text(rig_path), rig_path, path, 5.0, 5, lambda *_: None)

    (reported,), info, report = replayed(path)
    assert reported.names == ("table.map", "mock_ups.standard.imu.calibration.0")
    assert reported.contents == (table_map.read_text(), imu.read_text())
    assert dict(zip(reported.names, reported.sha256, strict=True)).items() <= info.calibration_sha256.items()
    assert report.agrees
    assert not report.missing_inputs
    # advice on levelling finds the legs in the recorded rig
    assert read_source(path, None, None).legs_m == {"A": (-1.8, -1.3), "B": (1.8, -1.3), "C": (0.0, 1.3)}

    write_map(table_map, 1e-3)
    _, _, report = replayed(path)
    assert not report.agrees
