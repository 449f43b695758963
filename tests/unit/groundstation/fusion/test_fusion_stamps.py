"""`groundstation fusion run` on tables whose stamps are wrong: set aside by line, crossed, or refused."""

import json

import numpy as np
import pytest

from groundstation.data_sets.fusion_folder import read_folder
from groundstation.files.errors import FileError
from groundstation.fusion.error_state_filter import ErrorStateFilter
from groundstation.fusion.estimator import Fix, ImuPacket

ROW = 2000
"""In flight."""


@pytest.fixture
def flight(make_folder, make_flight):
    return make_flight(make_folder(scenario="station", seed=7, duration_s=40.0))


@pytest.mark.parametrize("rows", [[ROW], [ROW, ROW + 1], [0], [-1]])
@pytest.mark.parametrize("off_s", [10.0, 600.0, 1e5, 1.76e9, 1e300, -10.0, np.nan])
def test_a_wild_stamp_is_named_by_its_line_and_harms_nothing(flight, rows, off_s):
    flight.imu[rows, 0] += off_s
    flight.run()
    known = np.isfinite(flight.error_m)
    assert flight.error_m[known].max() < 0.007  # as without it: 6 mm
    assert known[-200:-2].all()
    assert not known[rows].any()
    line = np.arange(len(flight.imu))[rows[0]] + 2
    assert f"{len(rows)} of {len(flight.imu)} packets set aside" in flight.output
    assert f" {line} (" in flight.output


@pytest.mark.parametrize("words", [(), ("--smooth",), ("--method", "reintegration")])
@pytest.mark.parametrize("gap_s", [3.0, 20.0, 40_000.0, 1.76e9])
def test_a_pause_is_crossed_at_once_and_the_doubt_is_said(flight, gap_s, words):
    edge_s = flight.imu[ROW, 0]
    flight.imu[ROW:, 0] += gap_s
    flight.stars[:, :2][flight.stars[:, :2] >= edge_s] += gap_s
    flight.run(*words)
    known = np.isfinite(flight.error_m)
    assert known[ROW + 500 : -1].all()
    if words[1:] != ("reintegration",):
        assert (flight.error_m[known] < 4.0 * flight.sigma_m[known]).all()
        assert np.nanmax(flight.error_m[ROW + 500 :]) < 0.012
    if "--smooth" not in words:
        assert "the estimate was lost from" in flight.output


def test_a_fix_from_before_a_hole_does_not_end_the_doubt(flight):
    edge_s = flight.imu[ROW, 0]
    flight.imu[ROW:, 0] += 3.0
    flight.stars[:, :2][flight.stars[:, :2] >= edge_s] += 3.0
    flight.run()
    span = flight.output.split("lost from ")[1].split()
    assert float(span[0]) == pytest.approx(edge_s + 3.0, abs=0.02)
    assert float(span[2]) - float(span[0]) > 2.0  # four fixes that agree, 0.6 s each


@pytest.mark.parametrize("both", [False, True])
def test_a_clock_that_is_set_back_is_counted_on(flight, both):
    edge_s = flight.imu[ROW, 0]
    flight.imu[ROW:, 0] -= 10.0
    if both:
        flight.stars[flight.stars[:, 1] > edge_s, :2] -= 10.0
    flight.run()
    assert f"line {ROW + 2}, the clock is set back by 9.9" in flight.output
    assert np.nanmax(flight.error_m) < 0.007


@pytest.mark.parametrize("both", [False, True])
@pytest.mark.parametrize("off_s", [100.0, -100.0, 5.0])
def test_an_island_of_stamps_costs_its_packets_and_no_fix(flight, off_s, both):
    rows = slice(ROW, ROW + 30)
    span_s = flight.imu[rows.start, 0], flight.imu[rows.stop, 0]
    flight.imu[rows, 0] += off_s
    if both:
        arrives_s = flight.stars[:, 1]
        flight.stars[(span_s[0] <= arrives_s) & (arrives_s < span_s[1]), :2] += off_s
    flight.run()
    assert f"30 of {len(flight.imu)} packets set aside" in flight.output
    assert "the clock is set back" not in flight.output
    used = np.genfromtxt(flight.folder / "fixes.csv", delimiter=",", names=True)["used"]
    assert used.sum() >= len(flight.stars) - 3
    known = np.isfinite(flight.error_m)
    assert (flight.error_m[known] < 4.0 * flight.sigma_m[known]).all()
    assert flight.error_m[ROW + 200 : -2].max() < 0.012


@pytest.mark.parametrize("off_s", [100.0, -100.0])
def test_live_an_island_is_told_and_the_fixes_that_follow_are_used(flight, off_s):
    data = read_folder(flight.folder)
    stamps_s = data.imu[:, 0].copy()
    stamps_s[ROW : ROW + 30] += off_s
    estimator = ErrorStateFilter(data.noise)
    estimator.begin_rest(0)
    fixes = sorted(zip(data.stars.tolist(), data.covariance, strict=True), key=lambda fix: fix[0][1])
    states, used, resting = [], 0, True
    for stamp_s, (true_s, *readings) in zip(stamps_s, data.imu.tolist(), strict=True):
        while fixes and fixes[0][0][1] <= true_s:
            (exposure_s, arrival_s, *pose), covariance = fixes.pop(0)
            used += estimator.add_fix(
                Fix(round(exposure_s * 1e9), round(arrival_s * 1e9), *pose, covariance)
            ).used
        if resting and true_s > data.run_start_s:
            estimator.end_rest(round(data.run_start_s * 1e9))
            resting = False
        states.append(estimator.add_imu(ImuPacket(round(stamp_s * 1e9), 0.01, *readings)))
    used += sum(account.used for account in estimator.settled())
    lost = [state is None or state.is_lost for state in states]
    assert any(lost[ROW : ROW + 300])
    assert not any(lost[ROW + 400 :])
    assert used >= len(data.stars) - 3
    true = flight.truth["x_m"][-1], flight.truth["y_m"][-1]
    assert np.hypot(states[-1].x_m - true[0], states[-1].y_m - true[1]) < 0.007


@pytest.mark.parametrize(("factor", "unit"), [(1e3, "milli"), (1e6, "micro"), (1e9, "nano")])
@pytest.mark.parametrize("which", ["imu", "stars"])
def test_other_units_are_refused_by_name(flight, which, factor, unit):
    table = getattr(flight, which)
    table[:, : 1 if which == "imu" else 2] *= factor
    with pytest.raises(FileError, match=rf"{which}\.csv: .*{unit}seconds\?.* expected"):
        flight.run()
    assert not (flight.folder / "estimate.csv").exists()


@pytest.mark.parametrize("origin_s", [1.76e9, 53_210.0, -1e4])
def test_another_origin_is_refused_with_what_to_do(flight, origin_s):
    flight.imu[:, 0] += origin_s
    flight.stars[:, :2] += origin_s
    with pytest.raises(FileError, match="take the first stamp off all"):
        flight.run()


@pytest.mark.parametrize("rate_hz", [10.0, 50.0, 98.0, 102.0, 200.0, 1000.0])
def test_a_rate_that_the_packets_contradict_is_refused(flight, rate_hz):
    meta = json.loads((flight.folder / "meta.json").read_text())
    meta["known"]["imu_rate_hz"] = rate_hz
    (flight.folder / "meta.json").write_text(json.dumps(meta))
    with pytest.raises(FileError, match=r"ms apart .*known\.imu_rate_hz"):
        flight.run()


@pytest.mark.parametrize("size", [2, 8, 40])
@pytest.mark.parametrize("apart_s", [0.0, 1e-4])
def test_stamps_of_deliveries_are_refused(flight, size, apart_s):
    rows = np.arange(len(flight.imu)) // size * size
    flight.imu[:, 0] = flight.imu[rows, 0] + apart_s * (np.arange(len(rows)) - rows)
    with pytest.raises(FileError, match="deliver"):
        flight.run()


@pytest.mark.parametrize("order", ["newest first", "shuffled"])
def test_rows_that_are_not_in_the_order_of_time_are_refused(flight, order):
    rows = np.arange(len(flight.imu))[::-1]
    flight.imu = flight.imu[rows if order == "newest first" else np.random.default_rng(0).permutation(rows)]
    with pytest.raises(FileError, match="sort them by time"):
        flight.run()


def test_wild_moments_of_fixes_cost_these_fixes(flight):
    flight.stars[20, 1], flight.stars[25, 1], flight.stars[27, 1], flight.stars[30, 0] = (
        1e9,
        -20.0,
        30.0,
        1e300,
    )
    flight.run()
    assert np.nanmax(flight.error_m) < 0.01
    lines = (flight.folder / "fixes.csv").read_text()
    assert lines.count("\n") == len(flight.stars) + 1
    for reason in ("arrives before its exposure", "arrived after the last packet", "no moment of any clock"):
        assert reason in lines


def test_every_row_twice_changes_nothing(flight):
    flight.run()
    once = np.nanmax(flight.error_m)
    flight.imu, flight.stars = np.repeat(flight.imu, 2, axis=0), np.repeat(flight.stars, 2, axis=0)
    flight.true_s = np.repeat(flight.true_s, 2)
    flight.run()
    assert np.nanmax(flight.error_m) == pytest.approx(once, rel=1e-3)
