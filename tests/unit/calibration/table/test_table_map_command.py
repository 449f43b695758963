"""`table-map` on data folders, and what it refuses."""

import json
import math
import re
import tomllib

import numpy as np
import pytest

from groundstation.declarations.errors import UsageError
from groundstation.files.errors import FileError
from groundstation.fusion.table_map import TableMap
from groundstation.recording.errors import RecordingError

LEGS = ("--leg", "A:-1.5,-1", "--leg", "B:1.5,-1", "--leg", "C:0,1")
KNOWN = {
    "run_start_s": 5.0, "duration_s": 205.0, "imu_rate_hz": 50.0, "poll_rate_hz": 1000.0,
    "imu_offset_m": [0.03, -0.02],
    "imu_offset_sigma_m": 1e-3, "mass_kg": 11.0, "inertia_kg_m2": 0.25, "star_sigma_xy_m": 5e-4,
    "star_sigma_heading_rad": 5e-4, "star_delay_s": 0.3, "gyro_noise_poll_rad_s": 1.7e-3,
    "gyro_lsb_rad_s": 0.0,
    "acc_noise_poll_m_s2": 2.06e-3, "acc_lsb_m_s2": 0.0, "gyro_tempco_rad_s_C": 3.5e-4,
    "acc_tempco_m_s2_C": 3e-4,
    "gyro_bandwidth_hz": 0.0, "acc_bandwidth_hz": 0.0,
}  # fmt: skip


@pytest.fixture
def folder(tmp_path, made_table, fly):
    """A data set of a flight over the made-up table."""
    rng = np.random.default_rng(12)
    log = fly(made_table, rng, laps=2, fix_sigma_m=5e-4)
    path = tmp_path / "laps"
    path.mkdir()
    (path / "meta.json").write_text(json.dumps({"known": KNOWN}))
    rate = np.gradient(log.heading_rad, log.end_s) + 0.004 + rng.normal(0.0, 4e-4, len(log.end_s))
    imu = np.column_stack([log.end_s, rate, log.force_body_m_s2, np.full(len(rate), 25.0)])
    imu[1000, 2] += 0.4  # a wild packet
    imu = np.delete(imu, [3000, 5000, 5001, 5002], axis=0)
    np.savetxt(
        path / "imu.csv",
        imu,
        "%.8f",
        ",",
        header="t_s,omega_rad_s,ax_m_s2,ay_m_s2,temperature_C",
        comments="",
    )
    heading = log.fix_heading_rad + rng.normal(0.0, 5e-4, len(log.fix_s))
    stars = np.column_stack(
        [log.fix_s, log.fix_s + 0.3, log.fix_position_m, np.mod(heading + math.pi, math.tau) - math.pi]
    )
    stars[100, 2] += 0.5  # a wrong fix
    np.savetxt(
        path / "stars.csv",
        stars,
        "%.8f",
        ",",
        header="t_exposure_s,t_arrival_s,x_m,y_m,heading_rad",
        comments="",
    )
    return path


@pytest.fixture
def run(groundstation):
    return lambda *words: groundstation("calibrate", "table-map", *words)


def test_a_folder_becomes_a_map_a_picture_and_advice(run, folder, tmp_path, made_table):
    out, plot = tmp_path / "map.toml", tmp_path / "map.png"
    done = run(
        folder, "--out", out, "--plot", plot, *LEGS, "--shortest-wave-m", "0.6", "--bounds", "-1.5,1.5,-1,1"
    )
    assert done.exit_code == 0, done.output
    assert "Raise leg B by" in done.stdout
    assert "bias and slope are separated" in done.stdout
    made = TableMap.load(out)
    rng = np.random.default_rng(1)
    places = rng.uniform((-1.1, -0.7), (1.1, 0.7), (100, 2))
    truth = made_table.pull(places)
    error = made.accelerations_m_s2(places) - truth
    sigma = np.array([made.sigma_m_s2(x, y) for x, y in places.tolist()])
    assert (error**2).mean() < 0.15 * truth.var(axis=0).mean()
    assert 0.1 < (error**2 / sigma**2).mean() < 1.5
    assert plot.read_bytes().startswith(b"\x89PNG")
    reported = tomllib.loads(out.read_text())
    assert reported["recordings"][0]["name"] == "laps"
    assert reported["mean"]["acceleration"]["unit"] == "m/s^2"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["laps", "map.npz", "map.png", "map.toml"]


def test_the_check_on_a_flight_is_reported(run, folder, tmp_path):
    done = run(folder, "--out", tmp_path / "map.toml", "--check", folder, "--shortest-wave-m", "0.8")
    assert done.exit_code == 0, done.output
    assert "laps: " in done.stdout
    assert "mm off with the map" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (("--leg", "A;1,2"), "--leg must be NAME:X,Y"),
        (("--leg", "A:1,x"), "--leg must be NAME:X,Y"),
        (("--leg", "A:0,0", "--leg", "A:0,1"), "--leg A is given twice"),
        (("--leg", "A:0,0", "--leg", "B:0,1"), "at least three"),
        (("--bounds", "1,2,3"), "--bounds must be X_MIN"),
        (("--bounds", "1,-1,0,1"), "--bounds must rise"),
        (("--shortest-wave-m", "0.01"), "within 0.15 and 5 m"),
    ],
)
def test_wrong_options_are_refused_before_anything_is_read(run, tmp_path, arguments, complaint):
    with pytest.raises(UsageError, match=re.escape(complaint)):
        run(tmp_path / "nothing", "--out", tmp_path / "map.toml", *arguments)


def test_wrong_inputs_are_refused_and_nothing_is_written(run, folder, tmp_path):
    for path, refusal, complaint in (
        (tmp_path / "none.mcap", RecordingError, "cannot be opened"),
        (folder / "imu.csv", RecordingError, "no MCAP file"),
        (tmp_path, FileError, r"meta\.json: cannot be read"),
    ):
        with pytest.raises(refusal, match=complaint):
            run(path, "--out", tmp_path / "map.toml", "--plot", tmp_path / "map.png")
    stars = (folder / "stars.csv").read_text()
    (folder / "stars.csv").write_text("t_exposure_s,t_arrival_s,x_m,y_m,heading_rad\n1,2,0,0,0\n2,3,1,1,1\n")
    with pytest.raises(UsageError, match="never had a pose"):
        run(folder, "--out", tmp_path / "map.toml")
    (folder / "stars.csv").write_text(stars)
    with pytest.raises(
        UsageError, match=r"a table of 180 m x 180 m .* takes more numbers than can be fitted"
    ):
        run(folder, "--out", tmp_path / "map.toml", "--bounds", "-90,90,-90,90")
    with pytest.raises(FileError, match="there is no folder"):
        run(folder, "--out", tmp_path / "nowhere" / "map.toml")
    assert [path.name for path in tmp_path.iterdir()] == ["laps"]
