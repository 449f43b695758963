"""`calibrate tilt` on recordings of the emulator's landed mock-up, and the commands that read recordings."""

import tomllib
from pathlib import Path

import pytest

from groundstation.declarations.errors import UsageError
from groundstation.launch.lockstep_run import run_lockstep
from groundstation.parts.fusion.estimation import rig_noise
from groundstation.recording.errors import RecordingError
from groundstation.rig.read import load_rig, read_text

RIGS = Path(__file__).parents[4] / "examples" / "rigs"
SCALE = (0.02, -0.03)


def record(folder, name, tilt_rad, heading_deg=5.0, seconds=5.0):
    """A recording of a mock-up that stays landed on a table of this tilt; its rig lies beside it."""
    text = (RIGS / "drawn_fixes.toml").read_text()
    for old, new in (
        ("tilt_rad = [0.0003, -0.0001]", f"tilt_rad = [{tilt_rad[0]}, {tilt_rad[1]}]"),
        ("start_heading_deg = 5.0", f"start_heading_deg = {heading_deg}"),
        ('reference = "laboratory:alpha/reference"', "starts_by_itself = false"),
        (
            'model = "published"',
            f'model = "published"\nacc_scale_error = [{SCALE[0]}, {SCALE[1]}]\nwarm_up_k = 0.0',
        ),
    ):
        assert old in text
        text = text.replace(old, new)
    rig_path, path = folder / f"{name}.toml", folder / f"{name}.mcap"
    rig_path.write_text(text)
    run_lockstep(load_rig(rig_path), read_text(rig_path), rig_path, path, seconds, 7, lambda *_: None)
    return path


@pytest.fixture
def run(groundstation):
    def call(*words: object) -> str:
        result = groundstation("calibrate", *words)
        assert result.exit_code == 0, result.output
        return result.output

    return call


@pytest.fixture(scope="module")
def blocks(tmp_path_factory):
    """Rests on gauge blocks: at heading 0 an axis above the horizontal is the table's uphill gradient."""
    folder = tmp_path_factory.mktemp("blocks")
    tilts = {
        "level": (0.0, 0.0),
        "x": (0.02, 0.0),
        "x_back": (-0.02, 0.0),
        "y": (0.0, 0.02),
        "y_back": (0.0, -0.02),
    }
    paths = [record(folder, name, tilt, heading_deg=0.0) for name, tilt in tilts.items()]
    rows = "".join(f"{57.29577951 * x},{57.29577951 * y}\n" for x, y in tilts.values())
    (folder / "tilts.csv").write_text("along_x_deg,along_y_deg\n" + rows)
    return folder, paths


def test_scales_of_the_emulated_block_are_found_and_a_rig_reads_them(run, blocks, tmp_path):
    folder, paths = blocks
    out, plot = tmp_path / "tilt.toml", tmp_path / "tilt.png"
    files = ("--tilts", folder / "tilts.csv", "--out", out, "--plot", plot)
    reported = run("tilt", *paths, *files, "--tilt-sigma-deg", 0.001)
    assert "5 rests" in reported
    found = tomllib.loads(out.read_text())
    for name, error in zip(("acc_scale_x", "acc_scale_y"), SCALE, strict=True):
        true = 1.0 - 1.0 / (1.0 + error)
        assert abs(found[name]["value"] - true) < 4.0 * found[name]["std"]
        assert found[name]["std"] < 2e-3
    (unknown,) = found["unknown"]  # one heading only
    assert unknown.startswith("the offset: ")
    assert plot.read_bytes().startswith(b"\x89PNG")
    text = (RIGS / "drawn_fixes.toml").read_text()
    (tmp_path / "rig.toml").write_text(
        text.replace("baud = 250000", 'baud = 250000\ncalibration = ["tilt.toml"]')
    )
    noise = rig_noise(load_rig(tmp_path / "rig.toml"), "alpha")
    assert len(noise.calibrated) == 4


def test_what_the_rests_cannot_tell_is_said_and_written_as_unknown(run, blocks, tmp_path):
    _, paths = blocks
    (tmp_path / "tilts.csv").write_text("along_x_deg,along_y_deg\n0,0\n1.1459,0\n-1.1459,0\n")
    reported = run("tilt", *paths[:3], "--tilts", tmp_path / "tilts.csv", "--out", tmp_path / "t.toml")
    assert "acc_scale_y: these rests do not determine it" in reported
    found = tomllib.loads((tmp_path / "t.toml").read_text())
    assert found["acc_scale_y"]["value"] != found["acc_scale_y"]["value"]  # nan
    assert found["unknown"]


def test_wrong_tilts_are_one_sentence(run, blocks, tmp_path):
    folder, paths = blocks
    out = tmp_path / "t.toml"
    with pytest.raises(UsageError, match="gives 5 tilts, but the recordings hold 2 rests"):
        run("tilt", *paths[:2], "--tilts", folder / "tilts.csv", "--out", out)
    with pytest.raises(UsageError, match="too alike"):
        run("tilt", *paths[:1] * 4, "--out", out)
    with pytest.raises(RecordingError, match="cannot be opened"):
        run("tilt", tmp_path / "none.mcap", "--out", out)
    assert not out.exists()


def test_the_other_calibrations_read_recordings_as_well(run, blocks, tmp_path):
    _, paths = blocks
    run("zero-offset", paths[0], "--out", tmp_path / "rest.toml", "--plot", tmp_path / "rest.png")
    found = tomllib.loads((tmp_path / "rest.toml").read_text())
    assert found["recording"] == "level.mcap"
    assert found["omega_offset"]["std"] < 1e-3
    run("allan", paths[0], "--out", tmp_path / "allan.toml")
    with pytest.raises(UsageError, match="8 fixes are needed"):
        run("gyro-scale", paths[0], "--out", tmp_path / "scale.toml")
    with pytest.raises(UsageError, match="needed"):
        run("temperature", paths[0], "--out", tmp_path / "temperature.toml")
    with pytest.raises(UsageError, match="no vehicle 'beta'"):
        run("zero-offset", paths[0], "--vehicle", "beta", "--out", tmp_path / "no.toml")
