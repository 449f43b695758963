"""The camera's delay measured from a flight whose rig believed another one."""

import math
import tomllib
from pathlib import Path

import pytest
from typer.testing import CliRunner

from calibration.camera.delay_file import read_delay
from groundstation.cli.errors import UsageError
from groundstation.cli.star_tracker import app
from groundstation.runtime.lockstep_run import run_lockstep
from groundstation.runtime.rig import parse_rig

RIG = Path(__file__).parents[2] / "examples" / "rigs" / "late_pipeline.toml"
TRUE_S = 0.055


@pytest.mark.slow
def test_the_delay_of_a_flight_is_found_and_read_by_the_next_rig(tmp_path):
    text = RIG.read_text().replace("../../calibration", str(RIG.parents[2] / "calibration"))
    text = text.replace("late_s = 0.6", "late_s = 0.0").replace("heading_deg = 0.0 }", "heading_deg = 45.0 }")
    station, laboratory = text.split("[laboratory]", 1)
    text = f"{station}[mock_ups.standard.fusion]\nrest_s = 1.0\n[laboratory]" + laboratory.replace(
        "delay_s = 0.015", f"delay_s = {TRUE_S}"
    )
    rig_path, recording, out = tmp_path / "rig.toml", tmp_path / "turn.mcap", tmp_path / "delay.toml"
    rig_path.write_text(text)
    run_lockstep(parse_rig(text, rig_path), rig_path, recording, 14.0, 3, lambda *_: None)
    call = ["delay", str(recording), "--out", str(out)]
    CliRunner().invoke(app, [*call, "--plot", str(tmp_path / "delay.png")], catch_exceptions=False)
    found = read_delay(out)
    std_s = tomllib.loads(out.read_text())["delay"]["std"]
    assert math.isclose(found.delay_s, TRUE_S, abs_tol=max(3.0 * std_s, 5e-4))
    assert std_s < 2e-3
    assert found.sigma_s < 3e-3
    measured = text.replace("delay_s = 0.015\ndelay_sigma_s = 0.001", 'delay_file = "delay.toml"', 1)
    assert parse_rig(measured, rig_path).mock_ups["standard"].star_camera.delay_s == found.delay_s
    with pytest.raises(UsageError, match="star cameras fly on alpha"):
        CliRunner().invoke(app, [*call, "--vehicle", "beta"], catch_exceptions=False)
