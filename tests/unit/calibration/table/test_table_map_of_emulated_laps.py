"""Laps of the emulated laboratory, flown in lockstep and recorded, against the surface it was built with."""

import importlib
from pathlib import Path

import numpy as np
import pytest

from calibration.table.equations import FlightPriors, flight_equations
from calibration.table.prediction import check_outages
from calibration.table.smoothed_flights import read_source
from calibration.table.surface_basis import SurfaceBasis
from calibration.table.surface_fit import fit_surface
from drivers.laboratory import load_laboratory
from groundstation.rig.read import load_rig

EXAMPLES = Path(__file__).parents[4] / "examples"
SEED = 4


@pytest.fixture
def fly_laps(monkeypatch):
    """Flies the laps of the example into a recording."""
    monkeypatch.syspath_prepend(str(EXAMPLES))
    survey_laps, waypoints = (importlib.import_module(name) for name in ("survey_laps", "waypoints"))

    def fly(path, duration_s, first):
        waypoints.record(survey_laps.RIG, path, duration_s, survey_laps.surveys(["alpha"], first), SEED)

    return fly


def true_surface(rig):
    """The surface that the laboratory draws from this seed."""
    surface = load_laboratory(rig.laboratory.name, rig.laboratory.table, SEED).surface
    return lambda places: np.array([surface.slope_acceleration(x, y) for x, y in places.tolist()])


@pytest.mark.slow
def test_the_map_of_emulated_laps_is_the_emulated_table(tmp_path, fly_laps):
    rig = load_rig(EXAMPLES / "rigs" / "survey_laps.toml")
    sources = []
    for name, duration_s, first in (("laps", 360.0, 0), ("fresh", 150.0, 9)):
        path = tmp_path / f"{name}.mcap"
        fly_laps(path, duration_s, first)
        sources.append(read_source(path, None, None))
    laps, fresh = sources[0].logs[0], sources[1].logs[0]
    basis = SurfaceBasis.over(sources[0].bounds_m)
    fit = fit_surface([flight_equations(laps, basis, FlightPriors())], basis)
    truth_at = true_surface(rig)

    # right along the laps, and as right as it says
    path = laps.position_table_m[2000::400]
    truth = truth_at(path)
    error = fit.acceleration_m_s2(path) - truth
    assert (error**2).mean() < 0.02 * truth.var(axis=0).mean()
    grid = np.array(np.meshgrid(np.linspace(-1.9, 1.9, 20), np.linspace(-1.4, 1.4, 15))).reshape(2, -1).T
    off = (fit.acceleration_m_s2(grid) - truth_at(grid)).ravel()
    values, vectors = np.linalg.eigh(fit.covariance(grid))
    loud = values > 1e-3 * values[-1]
    assert 0.3 < ((vectors.T @ off)[loud] ** 2 / values[loud]).mean() < 2.0

    # the mean over the table within its sigma
    mean, covariance = fit.mean_over(grid)
    wrong = mean - truth_at(grid).mean(axis=0)
    assert wrong @ np.linalg.solve(covariance, wrong) < 12.0

    # worth something on a lap it has not seen
    there = fresh.position_table_m[2000::200]
    unseen = truth_at(there)
    left = np.sqrt(((fit.acceleration_m_s2(there) - unseen) ** 2).mean() / ((mean - unseen) ** 2).mean())
    assert left < 0.25
    check = check_outages(fresh, fit.acceleration_m_s2, (float(mean[0]), float(mean[1])), FlightPriors())
    assert check.with_map_m < 0.35 * check.mean_only_m
