"""A table's slope: learned from laps, laid on a grid, fed forward."""

import numpy as np
import pytest
from typer.testing import CliRunner

from groundstation.cli.calibrate import app
from groundstation.cli.errors import UsageError
from groundstation.cli.fusion import estimate
from groundstation.cli.fusion_folder import read_folder
from groundstation.cli.table_map_file import map_lines, read_map
from groundstation.fusion.error_state_filter import ErrorStateFilter
from groundstation.fusion.table_map import (
    Bumps,
    TableMap,
    bumps_along,
    coefficient_sigma,
    levelling_m,
    noise_with,
)


def a_map(step: float = 0.1) -> TableMap:
    y, x = np.meshgrid(np.arange(-1, 1.01, step), np.arange(-1, 1.01, step), indexing="ij")
    return TableMap(-1.0, -1.0, step, 1e-3 * x, 2e-3 * y, np.full(x.shape, 1e-4))


def test_the_pull_of_a_bump_is_the_gradient_of_its_potential():
    bumps = Bumps(np.array([[0.1, -0.2]]), 0.15)

    def potential(p):
        return -np.exp(-0.5 * ((p - bumps.centre_m[0]) ** 2).sum() / 0.15**2)

    p = np.array([0.25, -0.1])
    for axis in (0, 1):
        d = np.zeros(2)
        d[axis] = 1e-6
        slope = (potential(p + d) - potential(p - d)) / 2e-6
        assert bumps.pull(p[None])[0, axis, 0] == pytest.approx(slope, rel=1e-6)


def test_the_prior_gives_the_pull_its_stated_size():
    rng = np.random.default_rng(0)
    path = np.array(np.meshgrid(np.linspace(-1, 1, 60), np.linspace(-1, 1, 60))).reshape(2, -1).T
    bumps = bumps_along(path, 0.1)
    pulls = bumps.pull(rng.uniform(-0.8, 0.8, (200, 2)))
    c = rng.normal(0.0, coefficient_sigma(2e-4, 0.1), (len(bumps.centre_m), 50))
    assert np.std(pulls @ c) == pytest.approx(2e-4, rel=0.1)


def test_a_map_is_linear_between_its_points_and_holds_at_its_edge():
    table_map = a_map()
    assert table_map.at(0.234, -0.567) == pytest.approx((0.234e-3, -1.134e-3))
    assert table_map.at(5.0, 0.0)[0] == pytest.approx(1e-3)
    x, y = np.random.default_rng(1).uniform(-1.2, 1.2, (2, 50))
    want = np.array([table_map.at(a, b) for a, b in zip(x, y, strict=True)]).T
    np.testing.assert_allclose(table_map.along(x, y), want)


def test_a_map_survives_its_file(tmp_path):
    (tmp_path / "map.csv").write_text("".join(map_lines(a_map())))
    again = read_map(tmp_path / "map.csv")
    np.testing.assert_allclose(again.pull_y_m_s2, a_map().pull_y_m_s2, atol=1e-8)
    assert again.at(0.33, 0.44) == pytest.approx(a_map().at(0.33, 0.44), abs=1e-8)


def test_a_grid_with_a_missing_point_is_refused(tmp_path):
    lines = list(map_lines(a_map()))
    (tmp_path / "map.csv").write_text("".join(lines[:40] + lines[41:]))
    with pytest.raises(UsageError, match="regular grid"):
        read_map(tmp_path / "map.csv")


def test_the_low_legs_are_raised_and_none_is_lowered():
    # pulled towards +x: the table hangs down on that side
    rise = levelling_m((1e-3, 0.0), {"A": (-1.0, 0.0), "B": (1.0, -0.5), "C": (1.0, 0.5)})
    assert rise["A"] == 0.0
    assert rise["B"] == pytest.approx(2e-3)
    assert rise["C"] == pytest.approx(2e-3)


@pytest.mark.slow
def test_laps_teach_a_map_that_cuts_the_velocity_error_of_the_next_flight(make_folder, tmp_path):
    common = {"scenario": "perimeter", "duration_s": 110.0, "table_seed": 7}
    laps = [make_folder(seed=seed, **common) for seed in (61, 62)]
    result = CliRunner().invoke(
        app,
        ["table-map", *map(str, laps), "--out", str(tmp_path / "map.csv"),
         "--plot", str(tmp_path / "map.png"), "--legs", "A=-1,-0.8 B=1,-0.8 C=0,0.9"],
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    assert "raise leg" in result.output
    table_map = read_map(tmp_path / "map.csv")
    fresh = make_folder(seed=63, **common)
    truth = np.genfromtxt(fresh / "truth.csv", delimiter=",", names=True)
    flown = truth["t_s"] > 12.0
    known = table_map.along(truth["x_m"][flown], truth["y_m"][flown])
    true = np.array([truth["slope_ax"][flown], truth["slope_ay"][flown]])
    assert (known - true).std() < 0.75 * (true - true.mean(axis=1, keepdims=True)).std()
    data = read_folder(fresh)
    error = {}
    for name, estimator in (
        ("without", ErrorStateFilter(data.noise)),
        ("with", ErrorStateFilter(noise_with(data.noise, table_map), table_map=table_map)),
    ):
        states, _ = estimate(data, estimator)
        t = data.imu[:, 0]
        rows = [k for k, s in enumerate(states) if s and 20.0 < t[k] < 109.0]
        v = np.array([states[k][4:6] for k in rows])
        want = np.column_stack([np.interp(t[rows], truth["t_s"], truth[c]) for c in ("vx_m_s", "vy_m_s")])
        error[name] = float(np.sqrt(np.mean((v - want) ** 2)))
    assert error["with"] < 0.85 * error["without"]


def test_constants_from_a_spin_lie_within_their_sigmas(make_folder, tmp_path):
    import tomllib

    folder = make_folder(scenario="spin", seed=64, duration_s=60.0)
    result = CliRunner().invoke(
        app, ["joint", str(folder), "--out", str(tmp_path / "j.toml"), "--plot", str(tmp_path / "j.png")]
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
