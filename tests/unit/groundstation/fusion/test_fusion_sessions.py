"""`groundstation fusion run` on two sessions in a folder, on fixes given twice, on columns that are none."""

import json

import numpy as np
import pytest

from groundstation.files.errors import FileError

FIRST_S = 25.0


@pytest.fixture
def flight(make_folder, make_flight):
    return make_flight(make_folder(scenario="perimeter", seed=7, duration_s=60.0))


def two_sessions(flight):
    """The start of the flight, and then all of it, measured again: the clock falls back to its begin."""
    rng = np.random.default_rng(1)
    rows, fixes = flight.imu[:, 0] < FIRST_S, flight.stars[:, 1] < FIRST_S
    imu, stars = flight.imu.copy(), flight.stars.copy()
    imu[:, 1:4] += rng.normal(scale=1e-4, size=(len(imu), 3))
    stars[:, 2:] += rng.normal(scale=1e-4, size=(len(stars), 3))
    first, true_s = int(rows.sum()), flight.true_s
    flight.imu = np.concatenate([flight.imu[rows], imu])
    flight.stars = np.concatenate([flight.stars[fixes], stars])
    flight.true_s = np.concatenate([true_s[rows], true_s])
    return first


@pytest.mark.parametrize("words", [(), ("--smooth",)])
def test_of_another_session_nothing_is_carried_over_from_the_one_before(flight, words):
    first = two_sessions(flight)
    flight.run(*words)
    assert f"line {first + 2}, the clock is set back by" in flight.output
    assert "another session" in flight.output
    known = np.isfinite(flight.error_m)
    assert known[first + 500 : -1].all()
    assert (flight.error_m[known] < 4.0 * flight.sigma_m[known]).all()
    assert np.nanmax(flight.error_m[first + 500 :]) < 0.02


def test_where_an_estimate_was_lost_is_told_in_the_stamps_of_the_file(flight):
    two_sessions(flight)
    flight.run()
    start_s, stop_s = (float(flight.output.split("lost from ")[1].split()[k]) for k in (0, 2))
    assert 0.0 <= start_s < stop_s < 5.0


def test_a_fix_that_is_given_again_under_another_stamp_counts_once(flight):
    flight.run()
    once_m = flight.sigma_m.copy()
    again = np.repeat(flight.stars, 2, axis=0)
    again[1::2, :2] += 1e-3
    flight.stars = again
    flight.run()
    np.testing.assert_array_equal(flight.sigma_m, once_m)
    fixes = (flight.folder / "fixes.csv").read_text()
    assert fixes.count("repeats a fix before") == len(again) // 2
    assert fixes.count("\n") == len(again) + 1


def test_fixes_that_are_written_with_few_digits_are_no_repeats(flight):
    flight.stars[:, 2:4] = np.round(flight.stars[:, 2:4], 3)
    flight.stars[:, 4] = np.round(flight.stars[:, 4], 3)
    flight.run()
    assert "repeats" not in flight.output
    assert "repeats" not in (flight.folder / "fixes.csv").read_text()


@pytest.mark.parametrize("column", [1, 2, 3])
@pytest.mark.parametrize("value", [np.nan, np.inf, 1e9])
def test_a_channel_without_readings_is_refused(flight, column, value):
    name = ("omega_rad_s", "ax_m_s2", "ay_m_s2")[column - 1]
    flight.imu[:, column] = value
    with pytest.raises(FileError, match=rf"imu\.csv: {name} is no number, or beyond .* in 100 %"):
        flight.run()


@pytest.mark.parametrize(
    ("column", "name"),
    [(0, "t_exposure_s"), (1, "t_arrival_s"), (2, "x_m"), (3, "y_m"), (4, "heading_rad")],
)
def test_a_column_of_the_fixes_that_is_none_or_frozen_is_named(flight, column, name):
    given = flight.stars[:, column].copy()
    flight.stars[:, column] = np.nan
    with pytest.raises(FileError, match=rf"stars\.csv: {name} is no number in"):
        flight.run()
    flight.stars[:, column] = given[5]
    with pytest.raises(FileError, match=rf"stars\.csv: {name} is the same in 100 % of the rows.*frozen"):
        flight.run()


@pytest.mark.parametrize(
    ("factor", "key_factor"),
    [(1 / 0.0254, 1.0), (1.0, 1e3), (1.0, 1e-3)],
    ids=["inches", "sigma in mm", "sigma in km"],
)
def test_resting_fixes_that_scatter_otherwise_than_stated_are_refused(flight, factor, key_factor):
    flight.stars[:, 2:4] *= factor
    meta = json.loads((flight.folder / "meta.json").read_text())
    meta["known"]["star_sigma_xy_m"] *= key_factor
    (flight.folder / "meta.json").write_text(json.dumps(meta))
    with pytest.raises(
        FileError, match=r"fixes of the rest.*scatter by .*known\.star_sigma_xy_m.*another unit"
    ):
        flight.run()
