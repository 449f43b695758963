"""`calibrate joint` on a recording of the emulator: constants, delay and slope map, each with its sigma."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from groundstation.fusion.table_map import TableMap
from groundstation.launch.lockstep_run import run_lockstep
from groundstation.rig.read import load_rig, read_text

RIGS = Path(__file__).parents[4] / "examples" / "rigs"
TILT = (0.0003, -0.0001)


@pytest.mark.slow
def test_a_recording_gives_constants_and_slope_map_with_sigmas(tmp_path, groundstation):
    text = (RIGS / "drawn_fixes.toml").read_text()
    rig_path, path = tmp_path / "rig.toml", tmp_path / "run.mcap"
    rig_path.write_text(
        text.replace('model = "published"', 'model = "published"\ngyro_scale_error = 0.01')
        .replace("heading_deg = 0.0 }", "heading_deg = 175.0 }")
        .replace("rate_hz = 1.5", "rate_hz = 5.0")
        .replace("delay_s = 0.6", "delay_s = 0.1")
    )
    run_lockstep(load_rig(rig_path), read_text(rig_path), rig_path, path, 45.0, 4, lambda *_: None)
    out, table_map, plot = (tmp_path / name for name in ("joint.toml", "map.toml", "joint.png"))
    words = ("calibrate", "joint", path, "--out", out, "--table-map", table_map, "--plot", plot)
    result = groundstation(*words)
    assert result.exit_code == 0, result.output
    found = tomllib.loads(out.read_text())
    assert abs(found["gyro_scale"]["value"] - (1.0 - 1.0 / 1.01)) < 4.0 * found["gyro_scale"]["std"] < 4e-3
    assert abs(found["camera_delay"]["value"]) < 4.0 * found["camera_delay"]["std"]
    for name, true in zip(("lever_x", "lever_y"), (0.03151, -0.02122), strict=True):
        assert abs(found[name]["value"] - true) < 4.0 * found[name]["std"]
    made = TableMap.load(table_map)
    pull = np.multiply(-9.80665, TILT)
    sigma = np.sqrt(np.diag(made.mean_covariance_m2_s4))
    assert (np.abs(np.subtract(made.mean_m_s2, pull)) < 4.0 * sigma + 1e-5).all()
    assert set(made.provenance.recordings) == {"run.mcap"}
    assert plot.read_bytes().startswith(b"\x89PNG")
