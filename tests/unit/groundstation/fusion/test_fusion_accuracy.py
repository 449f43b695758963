"""The estimators against truth on generated data: close, and honest about how close."""

import math

import numpy as np
import pytest

from groundstation.data_sets.fusion_folder import read_folder
from groundstation.fusion.estimators import ESTIMATORS
from groundstation.fusion.flight_data import estimate


def errors(folder, method="filter"):
    """Errors x, y, heading, vx, vy after settling, sigmas of the first three, NIS of used fixes."""
    data = read_folder(folder)
    states, accounts = estimate(data, ESTIMATORS[method](data.noise))
    truth = np.genfromtxt(folder / "truth.csv", delimiter=",", names=True)
    t = data.imu[:, 0]
    rows = [k for k, s in enumerate(states) if s and t[k] > 20.0 and t[k] < truth["t_s"][-1]]
    got = np.array([states[k][1:6] for k in rows])
    sigma = np.array([states[k][10:13] for k in rows])
    names = ("x_m", "y_m", "heading_rad", "vx_m_s", "vy_m_s")
    want = np.column_stack([np.interp(t[rows], truth["t_s"], truth[n]) for n in names])
    off = got - want
    off[:, 2] = np.remainder(off[:, 2] + math.pi, 2 * math.pi) - math.pi
    return off, sigma, [a.nis for a in accounts if a.reason == "used"]


def rms(values):
    return float(np.sqrt(np.mean(np.sum(np.atleast_2d(values.T) ** 2, axis=0))))


@pytest.mark.parametrize(("scenario", "limit_m"), [("station", 2.6e-3), ("drift", 3e-3), ("spin", 2.6e-3)])
def test_the_filter_stays_within_millimetres(make_folder, scenario, limit_m):
    off, _, _ = errors(make_folder(scenario=scenario, seed=21, duration_s=40.0))
    assert rms(off[:, :2]) < limit_m
    assert math.degrees(rms(off[:, 2])) < 0.05


def test_the_filter_beats_the_published_method(make_folder):
    folder = make_folder(scenario="station", seed=21, duration_s=40.0, wrong_share=0.0)
    ours, _, _ = errors(folder)
    published, _, _ = errors(folder, "reintegration")
    assert rms(ours[:, :2]) < 0.6 * rms(published[:, :2])
    assert rms(published[:, :2]) < 0.02


def test_the_published_method_takes_wrong_fixes_and_the_filter_none(make_folder):
    folder = make_folder(scenario="station", seed=22, duration_s=40.0, wrong_share=0.15)
    off, _, _ = errors(folder)
    assert np.abs(off[:, :2]).max() < 0.02
    published, _, _ = errors(folder, "reintegration")
    assert np.abs(published[:, :2]).max() > 0.1


@pytest.mark.slow
@pytest.mark.parametrize("scenario", ["station", "perimeter", "spin", "drift"])
def test_reported_sigmas_and_innovations_are_consistent_over_seeds(make_folder, scenario):
    inside, nis = [], []
    for seed in range(31, 39):
        off, sigma, innovations = errors(make_folder(scenario=scenario, seed=seed, duration_s=70.0))
        ratio = np.abs(off[:, :3]) / sigma
        inside.append([(ratio < k).mean() for k in (1, 2, 3)])
        nis += innovations
    one, two, three = np.mean(inside, axis=0)
    assert 0.60 < one < 0.78
    assert 0.91 < two < 0.985
    assert three > 0.985
    # chi squared with 3 degrees of freedom over some 600 fixes: 3 +- 0.1, and models are not the truth
    assert 2.6 < np.mean(nis) < 3.4


def test_the_sensors_low_pass_is_compensated(make_folder):
    lab = {"scenario": "spin", "seed": 23, "duration_s": 40.0}
    off, _, _ = errors(make_folder(**lab, gyro_bandwidth_hz=40.0, acc_bandwidth_hz=18.0))
    assert math.degrees(rms(off[:, 2])) < 0.06
    assert rms(off[:, :2]) < 2.6e-3


def test_a_star_outage_ends_within_centimetres(make_folder):
    folder = make_folder(scenario="drift", seed=24, duration_s=40.0, outage_s=(25.0, 35.0))
    off, _, _ = errors(folder)
    assert np.hypot(off[:, 0], off[:, 1]).max() < 0.08


def test_the_same_data_gives_the_same_estimate(make_folder):
    folder = make_folder(scenario="spin", seed=21, duration_s=40.0)
    first, _, _ = errors(folder)
    second, _, _ = errors(folder)
    np.testing.assert_array_equal(first, second)
