"""`groundstation calibrate`: numbers with provenance, and one sentence for what cannot be calibrated."""

import tomllib

import numpy as np
import pytest

from groundstation.declarations.errors import UsageError


@pytest.fixture
def run(groundstation):
    def call(*words: object) -> None:
        result = groundstation("calibrate", *words)
        assert result.exit_code == 0, result.output

    return call


def truth(folder):
    return np.genfromtxt(folder / "truth.csv", delimiter=",", names=True)


def test_the_offset_at_rest_is_bias_less_slope(run, make_folder, tmp_path):
    folder = make_folder(scenario="station", seed=51, duration_s=20.0)
    run("zero-offset", folder, "--out", tmp_path / "rest.toml")
    found = tomllib.loads((tmp_path / "rest.toml").read_text())
    start = truth(folder)[500]
    c, s = np.cos(start["heading_rad"]), np.sin(start["heading_rad"])
    want = start["bias_ax"] - (c * start["slope_ax"] + s * start["slope_ay"])
    assert found["ax_offset"]["value"] == pytest.approx(want, abs=5 * found["ax_offset"]["std"] + 5e-5)
    assert found["omega_offset"]["unit"] == "rad/s"
    assert len(found["recording_sha256"]) == 64
    assert found["made_utc"].tzinfo is not None


def test_the_published_fit_finds_the_offsets_in_flight(run, make_folder, tmp_path):
    folder = make_folder(scenario="station", seed=51, duration_s=40.0)
    run("zero-offset-fit", folder, "--start-s", 18, "--end-s", 38, "--out", tmp_path / "fit.toml")
    found = tomllib.loads((tmp_path / "fit.toml").read_text())
    middle = truth(folder)[2800]
    c, s = np.cos(middle["heading_rad"]), np.sin(middle["heading_rad"])
    mu = middle["bias_ax"] - (c * middle["slope_ax"] + s * middle["slope_ay"])
    nu = middle["bias_ay"] - (c * middle["slope_ay"] - s * middle["slope_ax"])
    # the heading turns by more than 0.1 rad meanwhile, and one offset cannot hold bias and slope both
    assert found["mu"]["value"] == pytest.approx(mu, abs=1e-3)
    assert found["nu"]["value"] == pytest.approx(nu, abs=1e-3)
    assert found["residual"]["position"]["value"] < 0.02


def test_the_gyro_scale_is_found_from_a_spin(run, make_folder, tmp_path):
    folder = make_folder(scenario="spin", seed=52, duration_s=60.0)
    run("gyro-scale", folder, "--out", tmp_path / "s.toml", "--plot", tmp_path / "s.png")
    found = tomllib.loads((tmp_path / "s.toml").read_text())
    assert abs(found["scale"]["value"]) < 6e-3
    assert found["scale"]["std"] < 5e-4
    assert (tmp_path / "s.png").read_bytes().startswith(b"\x89PNG")


def test_allan_deviation_of_a_rest_gives_the_white_noise(run, make_folder, tmp_path):
    folder = make_folder(scenario="rest", seed=53, duration_s=60.0)
    run("allan", folder, "--out", tmp_path / "a.toml", "--plot", tmp_path / "a.png")
    found = tomllib.loads((tmp_path / "a.toml").read_text())
    want = np.sqrt((2e-3**2 + 1.25e-3**2 / 12) / 1000)
    assert found["ax_random_walk"]["value"] == pytest.approx(want, rel=0.08)
    assert (tmp_path / "a.png").exists()


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (("gyro-scale",), "full turn"),
        (("temperature",), "are needed"),
        (("zero-offset-fit", "--start-s", 5, "--end-s", 5), "--end-s"),
        (("zero-offset-fit", "--start-s", 100, "--end-s", 110), "no packets"),
    ],
)
def test_what_cannot_be_calibrated_is_said_in_one_sentence(run, make_folder, tmp_path, command, words):
    folder = make_folder(scenario="station", seed=51, duration_s=20.0)
    with pytest.raises(UsageError, match=words):
        run(command[0], folder, *command[1:], "--out", tmp_path / "x.toml")
    assert not (tmp_path / "x.toml").exists()


def test_a_rest_somebody_leant_on_is_refused(run, make_folder, tmp_path):
    folder = make_folder(scenario="station", seed=51, duration_s=20.0)
    lines = (folder / "imu.csv").read_text().splitlines()
    for k in range(1, 700):
        cells = lines[k].split(",")
        cells[2] = f"{float(cells[2]) + 0.01 * (k % 97):.6f}"
        lines[k] = ",".join(cells)
    leant = tmp_path / "leant"
    leant.mkdir()
    (leant / "imu.csv").write_text("\n".join(lines) + "\n")
    (leant / "meta.json").write_text((folder / "meta.json").read_text())
    with pytest.raises(UsageError, match="undisturbed"):
        run("zero-offset", leant, "--out", tmp_path / "x.toml")
