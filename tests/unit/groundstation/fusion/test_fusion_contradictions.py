"""`groundstation fusion run` on tables that contradict each other or their description: refused, or named."""

import math

import numpy as np
import pytest

from groundstation.declarations.errors import UsageError
from groundstation.files.errors import FileError

ROW = 2000
GRAVITY_M_S2 = 9.80665


@pytest.fixture
def flight(make_folder, make_flight):
    return make_flight(make_folder(scenario="perimeter", seed=7, duration_s=60.0))


@pytest.mark.parametrize("size", [50, 700])
@pytest.mark.parametrize("at", ["within", "behind"])
def test_a_block_that_is_pasted_twice_changes_nothing(flight, size, at):
    """Not even the clock, which would else be taken for one that was set back."""
    flight.run()
    once = np.nanmax(flight.error_m)
    where = ROW + size if at == "within" else len(flight.imu)
    for name in ("imu", "true_s"):
        rows = getattr(flight, name)
        setattr(flight, name, np.concatenate([rows[:where], rows[where - size : where], rows[where:]]))
    flight.run()
    assert np.nanmax(flight.error_m) == pytest.approx(once, rel=1e-9)
    assert f"{size} of {len(flight.imu)} packets set aside" in flight.output
    assert f"all readings are those of an earlier line: lines {where + 2} (" in flight.output
    assert "clock" not in flight.output


@pytest.mark.parametrize(
    ("columns", "factor", "sentence"),
    [
        ([1], math.degrees(1.0), "omega_rad_s scatters .* in deg/s"),
        ([1], math.degrees(3600.0), "omega_rad_s scatters .* in deg/h"),
        ([2, 3], 1e3 / GRAVITY_M_S2, "ax_m_s2 scatters .* in mg"),
        ([3], 1e3, "ay_m_s2 scatters .* in mm/s"),
    ],
)
def test_readings_in_other_units_are_refused_by_how_they_scatter(flight, columns, factor, sentence):
    flight.imu[:, columns] *= factor
    with pytest.raises(FileError, match=sentence):
        flight.run()


@pytest.mark.parametrize("factor", [0.5, 1.5, 8.0])
def test_a_sensor_that_is_noisier_than_stated_is_not_taken_for_one_in_other_units(flight, factor):
    rng = np.random.default_rng(1)
    steps = np.diff(flight.imu[:, 1])
    sigma = 1.4826 * np.median(np.abs(steps)) / math.sqrt(2.0)
    flight.imu[:, 1] += rng.normal(0.0, sigma * factor, len(flight.imu))
    flight.run()
    assert "scatters" not in flight.output


@pytest.mark.parametrize("column", [1, 2, 3])
def test_a_channel_that_measures_nothing_is_named(flight, column):
    flight.imu[:, column] = 0.0125
    flight.run()
    name = ("t_s", "omega_rad_s", "ax_m_s2", "ay_m_s2")[column]
    assert f"{name} is 0.0125 in all {len(flight.imu)} packets" in flight.output


def test_interchanged_columns_of_moments_are_refused(flight):
    flight.stars[:, [0, 1]] = flight.stars[:, [1, 0]]
    with pytest.raises(FileError, match=r"t_arrival_s is before t_exposure_s in \d+ of \d+ rows"):
        flight.run()


@pytest.mark.parametrize("off_s", [120.0, 1.7e9])
def test_another_clock_of_the_fixes_is_not_taken_for_other_units(flight, off_s):
    flight.stars[:, :2] += off_s
    with pytest.raises(FileError, match="by another clock"):
        flight.run()


@pytest.mark.parametrize("fixes", [slice(0, 1), slice(0, 0)])
def test_fixes_from_which_no_estimate_begins_are_an_error(flight, fixes):
    flight.stars = flight.stars[fixes]
    with pytest.raises((UsageError, FileError)) as refused:
        flight.run()
    assert "an estimate begins with two fixes" in str(refused.value) or "no rows" in str(refused.value)


def negated_headings(flight):
    flight.stars[:, 4] *= -1.0


def negated_rates(flight):
    flight.imu[:, 1] *= -1.0


def headings_in_degrees(flight):
    flight.stars[:, 4] = np.degrees(flight.stars[:, 4])


def exposed_at_arrival(flight):
    flight.stars[:, 0] = flight.stars[:, 1]


def other_clock(off_s):
    def change(flight):
        flight.stars[:, :2] += off_s

    return change


def another_flight(flight):
    flight.stars[:, 4] = np.cumsum(np.random.default_rng(2).normal(0.0, 0.3, len(flight.stars)))


def swapped_places(flight):
    flight.stars[:, [2, 3]] = flight.stars[:, [3, 2]]


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (negated_headings, "has the other sign"),
        (negated_rates, "has the other sign"),
        (headings_in_degrees, "heading_rad is in degrees"),
        (other_clock(5.0), "exposed 5.0 s earlier: stars.csv and imu.csv are stamped by two clocks"),
        (other_clock(-4.0), "exposed 4.0 s later: stars.csv and imu.csv are stamped by two clocks"),
        (exposed_at_arrival, "exposed 0.6 s earlier"),
        (another_flight, "by no sign, unit or clock"),
        (swapped_places, "the packets do not explain the fixes"),
    ],
)
def test_tables_that_contradict_each_other_are_named_with_the_likely_cause(flight, change, sentence):
    change(flight)
    flight.run()
    assert sentence in flight.output


def test_tables_that_agree_are_not_accused_for_a_hole(flight):
    away = (flight.imu[:, 0] > 30.0) & (flight.imu[:, 0] < 38.0)
    flight.imu, flight.true_s = flight.imu[~away], flight.true_s[~away]
    flight.run()
    assert "lost from" in flight.output
    assert "explain" not in flight.output
    assert "turn" not in flight.output


def test_a_gyro_that_nobody_has_calibrated_contradicts_nothing(make_folder, make_flight):
    flight = make_flight(make_folder(scenario="spin", seed=7, duration_s=60.0))
    flight.imu[:, 1] *= 1.02
    flight.run()
    assert "turn" not in flight.output
