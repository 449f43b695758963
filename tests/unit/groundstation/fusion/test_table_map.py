"""A table's slope on a grid: fed forward by the filter; and every constant from one flight."""

import tomllib

import numpy as np
import pytest

from groundstation.data_sets.fusion_folder import read_folder
from groundstation.fusion.error_state_filter import ErrorStateFilter
from groundstation.fusion.flight_data import estimate
from groundstation.fusion.slope_grid import SlopeGrid, noise_with


def a_grid(step: float = 0.1) -> SlopeGrid:
    y, x = np.meshgrid(np.arange(-1, 1.01, step), np.arange(-1, 1.01, step), indexing="ij")
    return SlopeGrid(-1.0, -1.0, step, 1e-3 * x, 2e-3 * y, np.full(x.shape, 1e-4), (5e-4, -5e-4))


def test_a_grid_is_linear_between_its_points_and_the_mean_outside():
    grid = a_grid()
    assert grid.at(0.234, -0.567) == pytest.approx((0.234e-3, -1.134e-3))
    assert grid.at(5.0, 0.0) == (5e-4, -5e-4)
    x, y = np.random.default_rng(1).uniform(-1.2, 1.2, (2, 200))
    want = np.array([grid.at(a, b) for a, b in zip(x, y, strict=True)]).T
    np.testing.assert_allclose(grid.along(x, y), want)


def test_a_true_map_cuts_the_error_of_a_flight(fusion_truth, make_folder):
    settings = {"scenario": "perimeter", "seed": 63, "duration_s": 60.0, "table_seed": 7}
    folder = make_folder(**settings)
    table = fusion_truth.Table(np.random.default_rng([7, 99]), fusion_truth.Laboratory().waviness_m_s2)
    y, x = np.meshgrid(np.arange(-1.2, 1.21, 0.05), np.arange(-1.2, 1.21, 0.05), indexing="ij")
    pull = table.slope(np.column_stack([x.ravel(), y.ravel()])).T.reshape(2, *x.shape)
    grid = SlopeGrid(-1.2, -1.2, 0.05, pull[0], pull[1], np.full(x.shape, 3e-5), (0.0, 0.0))
    data = read_folder(folder)
    truth = np.genfromtxt(folder / "truth.csv", delimiter=",", names=True)
    error = {}
    for name, estimator in (
        ("without", ErrorStateFilter(data.noise)),
        ("with", ErrorStateFilter(noise_with(data.noise, grid), table_map=grid)),
    ):
        states, _ = estimate(data, estimator)
        t = data.imu[:, 0]
        rows = [k for k, s in enumerate(states) if s and 20.0 < t[k] < 59.0]
        v = np.array([states[k][4:6] for k in rows])
        want = np.column_stack([np.interp(t[rows], truth["t_s"], truth[c]) for c in ("vx_m_s", "vy_m_s")])
        error[name] = float(np.sqrt(np.mean((v - want) ** 2)))
    assert error["with"] < 0.7 * error["without"]


def test_constants_from_a_spin_lie_within_their_sigmas(make_folder, tmp_path, groundstation):
    folder = make_folder(scenario="spin", seed=64, duration_s=60.0)
    result = groundstation(
        "calibrate", "joint", folder, "--out", tmp_path / "j.toml", "--plot", tmp_path / "j.png"
    )
    assert result.exit_code == 0, result.output
    found = tomllib.loads((tmp_path / "j.toml").read_text())
    truth = np.genfromtxt(folder / "truth.csv", delimiter=",", names=True)
    for name, want in (
        ("slope_x", truth["slope_ax"][1200:].mean()),
        ("slope_y", truth["slope_ay"][1200:].mean()),
        ("camera_delay", 0.0),
    ):
        assert abs(found[name]["value"] - want) < 4.0 * found[name]["std"], name
    assert found["lever_x"]["std"] < 1.5e-3
    assert found["gyro_scale"]["std"] < 3e-4
    assert found["residual"]["x"]["value"] < 1.5e-3
