"""The map as data: interpolation, file, refusals."""

from datetime import UTC, datetime

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from calibration.table.equations import FlightPriors, flight_equations
from calibration.table.from_fit import map_of
from calibration.table.surface_basis import SurfaceBasis
from calibration.table.surface_fit import fit_surface
from groundstation.files.errors import FileError
from groundstation.fusion.table_map import G_M_S2, MapProvenance, TableMap

SAID = MapProvenance(
    datetime(2024, 5, 6, 7, 8, 9, tzinfo=UTC),
    {'odd "name".mcap': "ab" * 32},
    1.02,
    205.0,
    {"note": "a\\b", "n": 2.5},
)
BASIS = SurfaceBasis.over((-1.5, 1.5, -1.0, 1.0), 0.6)


def plain_map(slope=(0.0, 0.0)):
    """A map of the pull slope[0] * x, slope[1] * y over 2 m x 1 m."""
    x, y = np.meshgrid(np.linspace(-1.0, 1.0, 21), np.linspace(-0.5, 0.5, 11))
    sigma = np.full(x.shape, 1e-4)
    return TableMap(
        -1.0, -0.5, 0.1, slope[0] * x, slope[1] * y, sigma, 2.0 * sigma, 0.0 * x, (3e-3, -1e-3),
        np.eye(2) * 1e-9, 5e-4, SAID,
    )  # fmt: skip


@given(st.floats(-1.0, 1.0), st.floats(-0.5, 0.5))
def test_a_linear_pull_is_read_back_anywhere(x_m, y_m):
    found = plain_map((1e-3, -2e-3)).acceleration_m_s2(x_m, y_m)
    assert found == pytest.approx((1e-3 * x_m, -2e-3 * y_m), abs=1e-15)


@given(st.floats(allow_nan=True, allow_infinity=True), st.floats(allow_nan=True, allow_infinity=True))
def test_any_place_gets_finite_numbers(x_m, y_m):
    made = plain_map((1e-3, 1e-3))
    assert np.isfinite([*made.acceleration_m_s2(x_m, y_m), *made.sigma_m_s2(x_m, y_m)]).all()


def test_off_the_table_the_mean_slope_holds_with_its_larger_sigma():
    made = plain_map()
    assert made.acceleration_m_s2(1.01, 0.0) == (3e-3, -1e-3)
    assert made.sigma_m_s2(0.0, -0.6) == (5e-4, 5e-4)
    assert made.sigma_m_s2(0.0, 0.0) == pytest.approx((1e-4, 2e-4))


def test_the_mean_gradient_is_uphill():
    assert plain_map().mean_gradient_rad == pytest.approx((-3e-3 / G_M_S2, 1e-3 / G_M_S2))


@pytest.fixture
def learned(made_table, fly):
    log = fly(made_table, np.random.default_rng(3))
    return fit_surface([flight_equations(log, BASIS, FlightPriors())], BASIS)


def test_the_grid_follows_the_fit(learned):
    made = map_of(learned, SAID)
    rng = np.random.default_rng(1)
    places = rng.uniform((-1.5, -1.0), (1.5, 1.0), (200, 2))
    fit = learned.acceleration_m_s2(places)
    assert made.accelerations_m_s2(places) == pytest.approx(fit, abs=0.03 * fit.std())
    sigma = np.array([made.sigma_m_s2(x, y) for x, y in places.tolist()])
    assert sigma == pytest.approx(learned.sigma_m_s2(places), rel=0.08)
    assert made.mean_m_s2 == pytest.approx(made.accelerations_m_s2(places * 0.99).mean(axis=0), abs=1e-4)


def test_the_relief_falls_where_vehicles_are_pulled_to(learned):
    made = map_of(learned, SAID)
    down_y, down_x = np.gradient(-G_M_S2 * made.height_m, made.step_m)
    inner = (slice(2, -2), slice(2, -2))
    scale = (made.ax_m_s2 - made.mean_m_s2[0]).std()
    assert down_x[inner] == pytest.approx((made.ax_m_s2 - made.mean_m_s2[0])[inner], abs=0.05 * scale)
    assert down_y[inner] == pytest.approx((made.ay_m_s2 - made.mean_m_s2[1])[inner], abs=0.05 * scale)


def test_a_saved_map_is_read_back(learned, tmp_path):
    made = map_of(learned, SAID)
    made.save(tmp_path / "table_map.toml")
    back = TableMap.load(tmp_path / "table_map.toml")
    for name in ("ax_m_s2", "ay_m_s2", "sigma_x_m_s2", "sigma_y_m_s2", "height_m"):
        assert (getattr(back, name) == getattr(made, name)).all()
    assert back.mean_m_s2 == pytest.approx(made.mean_m_s2)
    assert back.mean_covariance_m2_s4 == pytest.approx(made.mean_covariance_m2_s4)
    assert back.acceleration_m_s2(0.3, 0.2) == pytest.approx(made.acceleration_m_s2(0.3, 0.2))
    assert back.provenance == SAID
    assert sorted(path.name for path in tmp_path.iterdir()) == ["table_map.npz", "table_map.toml"]


def test_a_grid_of_another_map_is_refused(tmp_path):
    plain_map().save(tmp_path / "one.toml")
    plain_map((1e-3, 0.0)).save(tmp_path / "two.toml")
    (tmp_path / "two.npz").replace(tmp_path / "one.npz")
    with pytest.raises(FileError, match=r"one\.npz is not the grid that .*one\.toml was written with"):
        TableMap.load(tmp_path / "one.toml")


def test_bad_files_are_refused_in_one_sentence(tmp_path):
    path = tmp_path / "map.toml"
    with pytest.raises(FileError, match="cannot be read"):
        TableMap.load(path)
    path.write_text("grid = [")
    with pytest.raises(FileError, match="not valid TOML"):
        TableMap.load(path)
    path.write_text("made_utc = 2024-01-01")
    with pytest.raises(FileError, match="key grid is missing"):
        TableMap.load(path)
    plain_map().save(path)
    path.with_suffix(".npz").unlink()
    with pytest.raises(FileError, match=r"map\.toml: its grid .*map\.npz: cannot be read"):
        TableMap.load(path)
    plain_map().save(path)
    path.write_text(path.read_text().replace("step_m = 0.1", "step_m = 0.0"))
    with pytest.raises(FileError, match="step_m must be above zero"):
        TableMap.load(path)


def test_a_map_that_cannot_be_written_leaves_nothing(tmp_path):
    with pytest.raises(FileError, match="cannot be written"):
        plain_map().save(tmp_path / "nowhere" / "map.toml")
    assert list(tmp_path.iterdir()) == []


def test_a_map_with_numbers_missing_is_refused():
    made = plain_map()
    hole = made.ax_m_s2.copy()
    hole[1, 1] = np.nan
    with pytest.raises(ValueError, match="ax_m_s2 holds a number that is not finite"):
        TableMap(
            -1.0, -0.5, 0.1, hole, made.ay_m_s2, made.sigma_x_m_s2, made.sigma_y_m_s2, made.height_m,
            (0.0, 0.0), np.eye(2), 1e-4, SAID,
        )  # fmt: skip
