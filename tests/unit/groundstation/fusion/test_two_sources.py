"""Fixes of two sources that come in another order than their exposures."""

import numpy as np
import pytest

from groundstation.fusion.error_state_filter import ErrorStateFilter
from groundstation.fusion.estimator import Fix, ImuPacket
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.past_fixes import MEMORY_S

MS = 1_000_000
STD = np.array([0.001, 0.001, 0.001])
SPEED_M_S, RATE_RAD_S = 0.05, 0.1


@pytest.fixture
def noise():
    return NoiseModel(
        packet_period_s=0.01,
        gyro_density_rad_s_rthz=6.7e-5,
        acc_density_m_s2_rthz=6.5e-5,
        star_sigma_xy_m=0.001,
        star_sigma_heading_rad=0.001,
    )


def fix(t_ms, source, rng, off_m=0.0):
    t = t_ms * 1e-3
    x, y, heading = np.array([SPEED_M_S * t + off_m, 0.0, RATE_RAD_S * t]) + STD * rng.standard_normal(3)
    return Fix(t_ms * MS, 0, x, y, heading, np.diag(STD**2), source)


def fly(estimator, arrivals, until_ms=8000):
    """Feed packets at 100 Hz and fixes at their arrivals (ms); give the accounts."""
    accounts = []
    waiting = sorted(arrivals, key=lambda item: item[0])
    for t_ms in range(10, until_ms + 1, 10):
        estimator.add_imu(ImuPacket(t_ms * MS, 0.01, RATE_RAD_S, 0.0, 0.0, float("nan")))
        while waiting and waiting[0][0] <= t_ms:
            accounts.append(estimator.add_fix(waiting.pop(0)[1]))
        accounts += estimator.settled()
    return accounts


def scenario(seed, off_m=0.0):
    rng = np.random.default_rng(seed)
    above = [fix(t, "overhead", rng) for t in range(100, 7900, 200)]
    stars = [fix(t, "stars", rng, off_m) for t in range(150, 7200, 650)]
    return above, stars


def test_late_fixes_of_a_slower_source_give_what_their_exposures_order_gives(noise):
    above, stars = scenario(1)
    late, ordered = ErrorStateFilter(noise), ErrorStateFilter(noise)
    accounts = fly(late, [(f.t_exposure_ns // MS + 20, f) for f in above] + [
        (f.t_exposure_ns // MS + 620, f) for f in stars
    ])  # fmt: skip
    fly(ordered, [(f.t_exposure_ns // MS + 20, f) for f in above + stars])
    used = [account.source for account in accounts if account.used]
    assert used.count("stars") >= len(stars) - 2  # the first came before there was anything to go back to
    assert used.count("overhead") == len(above)
    a, b = late.state(), ordered.state()
    assert abs(a.x_m - b.x_m) < 0.3 * b.sigma_x_m
    assert abs(a.heading_rad - b.heading_rad) < 0.3 * b.sigma_heading_rad
    assert abs(a.x_m - SPEED_M_S * 8.0) < 4 * a.sigma_x_m
    assert a.sigma_x_m == pytest.approx(b.sigma_x_m, rel=0.05)


def test_two_sources_know_more_than_one(noise):
    above, stars = scenario(2)
    alone, both = ErrorStateFilter(noise), ErrorStateFilter(noise)
    soon = [(f.t_exposure_ns // MS + 20, f) for f in above]
    fly(alone, soon)
    fly(both, soon + [(f.t_exposure_ns // MS + 620, f) for f in stars])
    assert both.state().sigma_x_m < alone.state().sigma_x_m


def test_a_late_fix_that_lies_leaves_the_estimate_as_it_was(noise):
    above, stars = scenario(3, off_m=0.05)
    soon = [(f.t_exposure_ns // MS + 20, f) for f in above]
    honest, lied_to = ErrorStateFilter(noise), ErrorStateFilter(noise)
    fly(honest, soon)
    accounts = fly(lied_to, soon + [(f.t_exposure_ns // MS + 620, f) for f in stars])
    refused = {account.reason for account in accounts if account.source == "stars" and not account.used}
    assert not [account for account in accounts if account.source == "stars" and account.used]
    assert refused <= {"outside the gate", "contradicts fixes after it", "older than the last used"}
    assert lied_to.state()[:-1] == pytest.approx(honest.state()[:-1], abs=1e-9)


def test_the_exposures_of_one_source_never_go_back(noise):
    above, stars = scenario(4)
    estimator = ErrorStateFilter(noise)
    fly(estimator, [(f.t_exposure_ns // MS + 20, f) for f in above[:10]] + [(300, stars[0])], 2100)
    again = estimator.add_fix(above[5])
    assert (again.used, again.reason) == (False, "older than the last used")


def test_a_fix_from_before_the_memory_is_too_old(noise):
    above, stars = scenario(5)
    estimator = ErrorStateFilter(noise)
    fly(estimator, [(f.t_exposure_ns // MS + 20, f) for f in above] + [(200, stars[0])])
    old_ms = 8000 - round(1000 * MEMORY_S) - 600
    assert estimator.add_fix(fix(old_ms, "stars", np.random.default_rng(1))).reason == (
        "older than the last used"
    )
    assert estimator.add_fix(fix(7500, "stars", np.random.default_rng(1))).used
