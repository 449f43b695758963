"""Rates of a stage: their errors beside the bound; the published statistics by hand."""

import json

import numpy as np
import pytest
from oracles import relative_scenes as scenes
from scipy.spatial.transform import Rotation

from groundstation.files.errors import FileError
from groundstation.relative_navigation.error_table import PUBLISHED_STAGE, error_statistics
from groundstation.relative_navigation.precession import AxialInertia
from groundstation.relative_navigation.stage_spin import LeavingCamera, Stage, StageRun, fit_stage

RING = np.array(
    [[-0.35 * (k % 2 == 0), 1.25 * np.cos(k * np.pi / 3), 1.25 * np.sin(k * np.pi / 3)] for k in range(6)]
)
INERTIA = np.array([2548.0, 14406.0, 14406.0])
RATE = np.deg2rad([-2.5, 1.0, 1.0])
STAGE = Stage(AxialInertia(2548.0, 14406.0), RING, LeavingCamera(600.0, 2.0, 1.0))


def exact(times, start=None, rate=RATE):
    """Rows t, marker, u, v: the spin is integrated, the camera is 2 + t before the stage."""
    rotations, _ = scenes.spin(np.asarray(times), start or Rotation.identity(), rate, INERTIA)
    rows = []
    for t, rotation in zip(times, rotations, strict=True):
        for marker, (x, y, z) in enumerate(rotation.apply(RING)):
            depth = 2.0 + t - x
            rows.append((t, marker, 600.0 * y / depth, 600.0 * z / depth))
    return np.array(rows)


def run_of(rows):
    return StageRun(rows[:, 0], rows[:, 1].astype(np.int64), rows[:, 2:])


def test_without_noise_the_rate_is_exact_from_any_attitude():
    for start in (Rotation.identity(), Rotation.from_rotvec([0.2, -0.3, 0.4])):
        fit = fit_stage(STAGE, run_of(exact([0.0, 0.5, 1.0], start)), 1e-3)
        assert fit.converged
        assert fit.rate_rad_s == pytest.approx(RATE, abs=1e-8)
        assert fit.start == pytest.approx(start.as_matrix(), abs=1e-7)


def test_errors_of_three_frames_are_those_of_the_bound(rng):
    """Reference 4.4: 0.1165, 0.2612, 0.2621 deg/s for three frames at 1 px."""
    rows = exact([0.0, 0.5, 1.0])
    errors, squares = [], []
    for _ in range(120):
        noisy = rows + np.c_[np.zeros((len(rows), 2)), rng.normal(0.0, 1.0, (len(rows), 2))]
        fit = fit_stage(STAGE, run_of(noisy), 1.0)
        errors.append(np.degrees(fit.rate_rad_s - RATE))
        squares.append(
            (fit.rate_rad_s - RATE) @ np.linalg.solve(fit.covariance[3:, 3:], fit.rate_rad_s - RATE)
        )
    bound = np.array([0.1165, 0.2612, 0.2621])
    assert np.degrees(np.sqrt(np.diag(fit.covariance)[3:])) == pytest.approx(bound, rel=0.03)
    ratio = np.sqrt(np.mean(np.square(errors)) / np.mean(bound**2))
    assert 0.85 < ratio < 1.15
    assert np.mean(squares) == pytest.approx(3.0, abs=0.7)


def test_the_published_formulas_by_hand():
    found = error_statistics(np.array([1.0, -2.0, 4.0]))
    assert (found.mean, found.mean_absolute) == (pytest.approx(1.0), pytest.approx(7.0 / 3.0))
    assert found.published_variance == pytest.approx(21.0 / 6.0)  # sum of squares over n (n - 1)
    assert found.variance == pytest.approx(9.0)
    assert found.rms == pytest.approx(np.sqrt(7.0))
    with pytest.raises(ValueError, match="at least two"):
        error_statistics(np.ones(1))


def test_the_printed_d_is_a_variance_of_the_mean():
    """Reference 0.2 item 13: the true rms of a run is sqrt(D (n - 1)), 0.132, 0.242, 0.177 deg/s."""
    rms = [np.sqrt(499 * d) for _, d, _ in PUBLISHED_STAGE.values()]
    assert rms == pytest.approx([0.132, 0.242, 0.177], abs=5e-4)


@pytest.fixture
def files(tmp_path, rng):
    rows = exact([0.0, 0.5, 1.0])
    lines = ["run,t,marker,u,v"]
    for run in range(3):
        noisy = rows + np.c_[np.zeros((len(rows), 2)), rng.normal(0.0, 1.0, (len(rows), 2))]
        lines += [f"{run}," + ",".join(f"{x:.7g}" for x in row) for row in noisy]
    (tmp_path / "3frames.csv").write_text("\n".join(lines) + "\n")
    stage = {
        "In": 14406.0,
        "Ix": 2548.0,
        "omega_deg_s": [-2.5, 1, 1],
        "markers_m": RING.tolist(),
        "f_px": 600.0,
        "camera": "at (2+t,0,0) m; looks along -x",
        "sigma_px": {"3frames": 1.0},
    }
    (tmp_path / "stage.json").write_text(json.dumps(stage))
    return tmp_path / "stage.json", tmp_path / "3frames.csv", stage


def test_the_command_gives_a_rate_for_every_run(groundstation, files, tmp_path):
    said = groundstation("relative", "spin", files[0], "--pixels", files[1], "--out", tmp_path / "rates.csv")
    lines = (tmp_path / "rates.csv").read_text().splitlines()
    assert lines[0] == "run,wx,wy,wz"
    assert len(lines) == 4
    assert np.degrees([float(x) for x in lines[1].split(",")[1:]]) == pytest.approx([-2.5, 1, 1], abs=1.5)
    assert "published M, D, sigma" in said.output


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"Ix": 40000.0}, "of no body"),
        ({"markers_m": [[0, 0, 0]]}, "markers_m"),
        ({"markers_m": [[0.5, 0, 1]] * 6}, "points 0 and 1 of markers_m are at the same place"),
        ({"markers_m": [[0, 0, 0], [1, 0, 0], [2, 0, 0]]}, "markers_m lie on one line"),
        ({"markers_m": [[0, 0, 0], [1e9, 0, 0], [0, 2, 0]]}, "markers_m must be finite and at most 1000 m"),
        ({"camera": "somewhere"}, "camera must tell"),
        ({"f_px": 0}, "f_px"),
        ({"f_px": 1e308}, "f_px"),
        ({"camera_start_m": 0, "camera_speed_m_s": 1.0}, "camera_start_m is 0"),
        ({"camera_start_m": 0.2, "camera_speed_m_s": 0.0}, "the camera is 0.2 m from the stage's middle"),
        ({"sigma_px": {"3frames": "much"}}, "sigma_px.3frames"),
        ({"sigma_px": 0}, "sigma_px is 0, expected"),
    ],
    ids=str,
)
def test_a_stage_that_is_wrong_is_refused(groundstation, files, tmp_path, change, words):
    files[0].write_text(json.dumps(files[2] | change))
    with pytest.raises(FileError, match=words):
        groundstation("relative", "spin", files[0], "--pixels", files[1], "--out", tmp_path / "rates.csv")
    assert not (tmp_path / "rates.csv").exists()


def test_a_run_of_one_frame_is_refused(groundstation, files, tmp_path):
    text = files[1].read_text() + "".join(f"7,0,{k},1,{k}\n" for k in range(6))
    files[1].write_text(text)
    with pytest.raises(FileError, match="run 7"):
        groundstation("relative", "spin", files[0], "--pixels", files[1], "--out", tmp_path / "rates.csv")


def test_a_marker_seen_twice_in_a_frame_is_refused(groundstation, files, tmp_path):
    lines = files[1].read_text().splitlines()
    files[1].write_text("\n".join([*lines, lines[1]]) + "\n")
    with pytest.raises(FileError, match="run 0 shows marker 0 twice at t = 0 s"):
        groundstation("relative", "spin", files[0], "--pixels", files[1], "--out", tmp_path / "rates.csv")


def test_an_unknown_rate_is_nan_and_no_part_of_the_statistics(groundstation, files, tmp_path):
    out = tmp_path / "rates.csv"
    words = ("relative", "spin", files[0], "--pixels", files[1], "--out", out)
    before = groundstation(*words).output.splitlines()
    nowhere = "".join(f"9,{t},{k},1e6,-1e6\n" for t in (0, 0.5, 1) for k in range(6))
    files[1].write_text(files[1].read_text() + nowhere)
    after = groundstation(*words).output.splitlines()
    assert after[0].startswith("4 runs, 1 without a known rate")
    assert "did not come to rest" in after[1]
    assert after[2:] == before[1:]
    assert out.read_text().splitlines()[-1] == "9,nan,nan,nan"
    files[1].write_text("run,t,marker,u,v\n" + nowhere)
    assert len(groundstation(*words).output.splitlines()) == 2


def test_pixels_of_nothing_give_no_rate(groundstation, files, tmp_path, rng):
    lines = ["run,t,marker,u,v"]
    for run, scatter_px in enumerate((300.0, 30.0)):
        for t_s in (0.0, 0.5, 1.0):
            for marker, (u, v) in enumerate(rng.uniform(-scatter_px, scatter_px, (6, 2))):
                lines.append(f"{run},{t_s},{marker},{u},{v}")
    files[1].write_text("\n".join(lines) + "\n")
    said = groundstation("relative", "spin", files[0], "--pixels", files[1], "--out", tmp_path / "rates.csv")
    rows = (tmp_path / "rates.csv").read_text().splitlines()[1:]
    assert [row.split(",")[1:] for row in rows] == [["nan"] * 3] * 2
    assert "2 without a known rate" in said.output
    assert "the pixels miss the stage by more than 3 sigma_px: " in said.output


def test_pixels_that_are_worse_than_stated_widen_the_covariance(rng):
    run = run_of(exact([0.0, 0.5, 1.0]))
    noisy = StageRun(run.times_s, run.marker, run.pixels + rng.normal(0.0, 2.0, run.pixels.shape))
    stated, true = fit_stage(STAGE, noisy, 1.0), fit_stage(STAGE, noisy, 2.0)
    assert stated.converged
    assert np.sqrt(np.diag(stated.covariance) / np.diag(true.covariance)) == pytest.approx(
        np.ones(6), rel=0.35
    )
