import math

import numpy as np
import pytest

from groundstation.data_sets.fusion_folder import read_folder
from groundstation.fusion.creep_watch import CreepWatch
from groundstation.fusion.error_state_filter import ErrorStateFilter
from groundstation.fusion.flight_data import estimate


@pytest.mark.parametrize("interval_s", [0.02, 1.0 / 15.0, 0.67, 5.0])
def test_honest_innovations_hardly_ever_raise_it(interval_s):
    rng = np.random.default_rng(0)
    watch = CreepWatch()
    added = [watch.variance_to_add(z, 1e-6, interval_s) for z in rng.normal(0.0, 1e-3, 20_000)]
    assert np.mean(np.array(added) > 0.0) < 2e-3


@pytest.mark.parametrize("rate_hz", [15.0, 50.0])
def test_an_hour_of_honest_quick_fixes_never_opens_the_null_to_what_would_be_a_shift(rate_hz):
    """Runs of chance came every few minutes where the memory was one of seven fixes, half a second long."""
    rng = np.random.default_rng(1)
    watch = CreepWatch()
    added = [watch.variance_to_add(z, 0.85e-3**2, 1.0 / rate_hz) for z in rng.normal(0.0, 0.85e-3, 54_000)]
    in_a_second = np.convolve(added, np.ones(round(rate_hz)), "valid")
    assert math.degrees(np.sqrt(in_a_second.max())) < 0.1


def test_a_creep_among_quick_fixes_is_noticed_within_seconds():
    watch = CreepWatch()
    added = [watch.variance_to_add(0.8e-3, 0.85e-3**2, 1.0 / 15.0) for _ in range(60)]
    assert added[0] == 0.0
    assert added[-1] > 0.0


def test_innovations_that_lean_to_one_side_open_the_null_until_they_stand_again():
    watch = CreepWatch()
    leaning = [watch.variance_to_add(2e-3, 1e-6, 0.67) for _ in range(10)]
    assert leaning[0] == 0.0
    assert leaning[-1] > (1e-3) ** 2
    upright = [watch.variance_to_add(0.0, 1e-6, 0.67) for _ in range(10)]
    assert upright[-1] == 0.0


def test_a_gyro_that_warms_up_by_degrees_per_second_is_followed(make_folder):
    folder = make_folder(scenario="station", seed=71, duration_s=50.0, gyro_warm_up_rad_s=math.radians(1.0))
    data = read_folder(folder)
    estimator = ErrorStateFilter(data.noise)
    states, _ = estimate(data, estimator)
    truth = np.genfromtxt(folder / "truth.csv", delimiter=",", names=True)
    t = data.imu[:, 0]
    rows = [k for k, s in enumerate(states) if s and 20.0 < t[k] < 49.0]
    heading = np.array([states[k].heading_rad for k in rows])
    off = heading - np.interp(t[rows], truth["t_s"], truth["heading_rad"])
    assert math.degrees(float(np.sqrt(np.mean(off**2)))) == pytest.approx(0.08, abs=0.08)
    assert "fix_starts_the_estimate_again" not in estimator.counters.by_name
