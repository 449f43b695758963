"""The map of a made-up table, learned from made-up flights, against the truth."""

import dataclasses

import numpy as np
import pytest

from calibration.table.equations import FlightPriors, flight_equations
from calibration.table.prediction import check_outages
from calibration.table.separability import separability
from calibration.table.surface_basis import SurfaceBasis
from calibration.table.surface_fit import fit_surface

BASIS = SurfaceBasis.over((-1.5, 1.5, -1.0, 1.0), 0.5)
PRIORS = FlightPriors()


def learn(*logs):
    return fit_surface([flight_equations(log, BASIS, PRIORS) for log in logs], BASIS)


def grid_of(x_m, y_m, step_m=0.2):
    x, y = np.arange(-x_m, x_m + 1e-9, step_m), np.arange(-y_m, y_m + 1e-9, step_m)
    return np.array(np.meshgrid(x, y)).reshape(2, -1).T


def test_the_map_explains_the_waves_along_the_laps(made_table, fly):
    rng = np.random.default_rng(11)
    log = fly(made_table, rng, laps=3, fix_rate_hz=2.0)
    fit = learn(log)
    path = log.position_table_m[::50]
    truth = made_table.pull(path)
    error = fit.acceleration_m_s2(path) - truth
    assert (error**2).mean() < 0.03 * ((truth - truth.mean(axis=0)) ** 2).mean()


def test_errors_of_the_map_are_as_large_as_it_says(made_table_of, fly):
    """Joint chi-square of the field at places all over the table, over tables and flights."""
    places = grid_of(1.2, 0.8, 0.3)
    squares, mean_squares = [], []
    for seed in range(5):
        rng = np.random.default_rng([5, seed])
        table = made_table_of(rng)
        fit = learn(fly(table, rng, laps=2, fix_sigma_m=1e-3, fix_rate_hz=2.0))
        error = (fit.acceleration_m_s2(places) - table.pull(places)).ravel()
        covariance = fit.covariance(places)
        values, vectors = np.linalg.eigh(covariance)
        loud = values > 1e-4 * values[-1]
        squares.append(float(((vectors.T @ error)[loud] ** 2 / values[loud]).mean()))
        mean, mean_covariance = fit.mean_over(places)
        off = mean - table.pull(places).mean(axis=0)
        mean_squares.append(float(off @ np.linalg.solve(mean_covariance, off)) / 2.0)
    assert 0.5 < np.mean(squares) < 1.5
    assert 0.1 < np.mean(mean_squares) < 2.5


def test_what_was_never_visited_is_as_uncertain_as_before(made_table, fly):
    log = fly(made_table, np.random.default_rng(2), laps=1)
    fit = learn(log)
    visited = fit.sigma_m_s2(log.position_table_m[1000::500])
    basis = SurfaceBasis.over((-1.5, 4.0, -1.0, 3.0), 0.5)
    wide = fit_surface([flight_equations(log, basis, PRIORS)], basis)
    far = wide.sigma_m_s2(np.array([[3.8, 2.8], [3.5, 2.5]]))
    assert visited.max() < 0.4 * fit.waviness_m_s2
    assert far.min() > 0.8 * wide.waviness_m_s2


def test_bias_and_slope_are_not_told_apart_without_turning(made_table, fly):
    rng = np.random.default_rng(4)
    straight = separability(learn(fly(made_table, rng, turning=0.0, name="straight")))[0]
    turning = separability(learn(fly(made_table, rng, turning=1.0, name="turning")))[0]
    assert not straight.is_separated
    assert straight.correlation > 0.99
    assert "straight: the heading turned through only 0°" in straight.sentence()
    assert turning.is_separated
    assert max(turning.pull_sigma_m_s2) < 0.1 * max(straight.pull_sigma_m_s2)
    assert "are separated" in turning.sentence()


def test_a_flight_that_says_nothing_is_not_called_separated(made_table, fly):
    log = fly(made_table, np.random.default_rng(4), laps=1)
    few = log.fix_s < 3.0
    names = ("fix_s", "fix_position_m", "fix_covariance_m2", "fix_heading_rad", "fix_velocity_m_s")
    short = dataclasses.replace(log, rests_s=(), **{name: getattr(log, name)[few] for name in names})
    verdict = separability(learn(short))[0]
    assert not verdict.is_separated
    assert "too short" in verdict.sentence() or "cannot be told apart" in verdict.sentence()


def test_the_bias_of_a_turning_flight_is_found(made_table, fly):
    log = fly(made_table, np.random.default_rng(6))
    shifted = dataclasses.replace(log, force_body_m_s2=log.force_body_m_s2 + np.array([0.02, -0.01]))
    before, after = separability(learn(log))[0], separability(learn(shifted))[0]
    moved = np.array(after.bias_m_s2) - np.array(before.bias_m_s2)
    assert moved == pytest.approx([0.02, -0.01], abs=2e-5)


def test_a_map_shrinks_the_error_of_an_outage_on_a_fresh_lap(made_table, fly):
    rng = np.random.default_rng(8)
    fit = learn(fly(made_table, rng, laps=3, fix_rate_hz=2.0))
    mean, _ = fit.mean_over(grid_of(1.4, 0.9))
    fresh = fly(made_table, rng, laps=2, name="fresh")
    check = check_outages(fresh, fit.acceleration_m_s2, (float(mean[0]), float(mean[1])), PRIORS)
    assert check.outages >= 8
    assert check.with_map_m < 0.4 * check.mean_only_m < 0.4 * check.without_m


def test_noise_that_was_told_too_small_is_found_out(made_table, fly):
    log = fly(made_table, np.random.default_rng(9))
    told = dataclasses.replace(log, fix_covariance_m2=log.fix_covariance_m2 / 9.0)
    fit, boasting = learn(log), learn(told)
    assert fit.chi_square_ratio == pytest.approx(1.0, abs=0.1)
    assert 5.0 < boasting.chi_square_ratio < 10.0
    place = np.array([[0.0, 0.0]])
    assert boasting.sigma_m_s2(place)[0, 0] > 0.6 * fit.sigma_m_s2(place)[0, 0]


def test_two_flights_know_more_than_one(made_table, fly):
    rng = np.random.default_rng(10)
    first, second = fly(made_table, rng), fly(made_table, rng)
    places = grid_of(1.0, 0.6)
    assert learn(first, second).sigma_m_s2(places).mean() < 0.9 * learn(first).sigma_m_s2(places).mean()


def test_modes_pull_along_the_gradient_of_their_potential():
    places = grid_of(1.0, 0.7, 0.35)
    step = 1e-6
    for axis in (0, 1):
        off = np.zeros(2)
        off[axis] = step
        slope = (BASIS.potentials(places + off) - BASIS.potentials(places - off)) / (2.0 * step)
        assert BASIS.columns(places)[:, axis] == pytest.approx(slope, abs=1e-7)


def test_the_prior_of_the_modes_has_the_waviness_it_was_given():
    columns = BASIS.columns(grid_of(1.4, 0.9, 0.1))
    for length_m in (0.3, 0.6, 1.0):
        variance = (columns**2 @ BASIS.prior_variance(3e-4, length_m)).mean(axis=0)
        assert np.sqrt(variance) == pytest.approx([3e-4, 3e-4], rel=0.1)


def test_a_flight_with_hardly_any_fixes_is_refused(made_table, fly):
    log = fly(made_table, np.random.default_rng(1), laps=1)
    few = dataclasses.replace(
        log, **{name: getattr(log, name)[:4] for name in (
            "fix_s", "fix_position_m", "fix_covariance_m2", "fix_heading_rad", "fix_velocity_m_s")},
    )  # fmt: skip
    with pytest.raises(ValueError, match="lap has 4 fixes"):
        flight_equations(few, BASIS, PRIORS)


def test_a_log_with_a_hole_in_its_numbers_is_refused(made_table, fly):
    log = fly(made_table, np.random.default_rng(1), laps=1)
    force = log.force_body_m_s2.copy()
    force[7] = np.nan
    with pytest.raises(ValueError, match="force_body_m_s2 must be finite"):
        dataclasses.replace(log, force_body_m_s2=force)
