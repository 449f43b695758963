"""The camera's delay measured from flights whose rig believed another one."""

import math
import tomllib
from pathlib import Path

import pytest

from groundstation.declarations.errors import UsageError
from groundstation.launch.lockstep_run import run_lockstep
from groundstation.parts.stars.sections import StarsOfType
from groundstation.rig.read import parse_rig
from groundstation.star_tracking.stamp_delay import read_delay

RIG = Path(__file__).parents[2] / "examples" / "rigs" / "late_pipeline.toml"


def rig_of(heading_deg, delay_s):
    """A rig that turns from 5 degrees to another heading, its pictures late by other than it believes."""
    text = RIG.read_text().replace("../../calibration", str(RIG.parents[2] / "calibration"))
    text = text.replace("late_s = 0.6", "late_s = 0.0")
    text = text.replace("heading_deg = 0.0 }", f"heading_deg = {heading_deg} }}")
    station, laboratory = text.split("[laboratory]", 1)
    return f"{station}[mock_ups.standard.fusion]\nrest_s = 1.0\n[laboratory]" + laboratory.replace(
        "delay_s = 0.015", f"delay_s = {delay_s}"
    )


def fly_and_measure(groundstation, folder, heading_deg, delay_s, seed):
    """The command's call and the file that it wrote."""
    text = rig_of(heading_deg, delay_s)
    rig_path, recording, out = folder / "rig.toml", folder / "turn.mcap", folder / "delay.toml"
    rig_path.write_text(text)
    run_lockstep(parse_rig(text, rig_path), text, rig_path, recording, 14.0, seed, lambda *_: None)
    call = ["calibrate", "delay", recording, "--out", out]
    groundstation(*call, "--plot", folder / "delay.png")
    return call, out


@pytest.mark.slow
def test_the_delay_of_a_flight_is_found_and_read_by_the_next_rig(tmp_path, groundstation):
    call, out = fly_and_measure(groundstation, tmp_path, 45.0, 0.055, 3)
    found = read_delay(out)
    sigma_s = tomllib.loads(out.read_text())["delay"]["std"]
    assert math.isclose(found.delay_s, 0.055, abs_tol=3.0 * sigma_s)
    assert sigma_s < 1e-3
    assert found.sigma_s < 3e-3
    text, rig_path = rig_of(45.0, 0.055), tmp_path / "rig.toml"
    measured = text.replace("delay_s = 0.015\ndelay_sigma_s = 0.001", 'delay_file = "delay.toml"', 1)
    camera = parse_rig(measured, rig_path).of_type("alpha", StarsOfType).star_camera
    assert camera.delay == (found.delay_s, found.sigma_s)
    with pytest.raises(UsageError, match="star cameras fly on alpha"):
        groundstation(*call, "--vehicle", "beta")


@pytest.mark.slow
def test_the_spread_of_the_delay_is_true_on_other_turns(tmp_path, groundstation):
    flights = [(90.0, 0.03, 21), (-60.0, 0.08, 22), (150.0, 0.055, 23), (-120.0, 0.03, 24), (30.0, 0.08, 25)]
    squares = []
    for heading_deg, delay_s, seed in flights:
        folder = tmp_path / str(seed)
        folder.mkdir()
        _, out = fly_and_measure(groundstation, folder, heading_deg, delay_s, seed)
        delay = tomllib.loads(out.read_text())["delay"]
        squares.append(((delay["value"] - delay_s) / delay["std"]) ** 2)
        assert delay["std"] < 2e-3
    assert sum(squares) / len(squares) < 3.0  # a chi-square of five: exceeded once in a hundred
