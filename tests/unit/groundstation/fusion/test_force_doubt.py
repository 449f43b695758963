"""An accelerometer that is not believed: the noise that takes its place, and readings made up for it."""

import math

import numpy as np
import pytest

from groundstation.fusion import error_state as es
from groundstation.fusion.error_state_filter import ErrorStateFilter
from groundstation.fusion.estimator import Fix, ImuPacket
from groundstation.fusion.force_doubt import ForceDoubt
from groundstation.fusion.noise import NoiseModel

NOISE = NoiseModel(
    packet_period_s=0.01,
    gyro_density_rad_s_rthz=6.7e-5,
    acc_density_m_s2_rthz=6.5e-5,
    star_sigma_xy_m=1e-3,
    star_sigma_heading_rad=9e-4,
    imu_offset_x_m=0.03,
    imu_offset_y_m=-0.02,
)
COV = np.diag([1e-6, 1e-6, 8e-7])


def test_the_added_covariance_is_that_of_white_forces_along_the_lost_axis():
    density, heading, n = 2e-3, 0.7, 400
    doubt = ForceDoubt(density)
    doubt.change(1.0, x=False, y=True)
    doubt.change(1.6, x=False, y=False)
    added = doubt.noise(0.0, 2.0, heading)
    # each short step kicks the velocity and, with what is left of the time, the position
    h = 0.6 / n
    along = np.array([-math.sin(heading), math.cos(heading)])
    sums = np.zeros((4, 4))
    for left in 2.0 - (1.0 + h * (np.arange(n) + 0.5)):
        kick = np.concatenate([along, along * left])
        sums += density**2 * h * np.outer(kick, kick)
    order = [es.VX, es.VY, es.PX, es.PY]
    assert np.allclose(added[np.ix_(order, order)], sums, rtol=1e-4, atol=1e-15)
    assert doubt.noise(1.6, 2.0, heading) is None
    assert not doubt.is_open


def test_an_old_doubt_is_forgotten_and_an_open_one_kept():
    doubt = ForceDoubt(1e-3)
    doubt.change(1.0, x=True, y=False)
    doubt.change(2.0, x=True, y=True)
    doubt.forget_before(2.5)
    assert doubt.is_open
    assert not doubt.touches(0.0, 1.9)
    assert doubt.touches(3.0, 3.1)


def flown(doubtful, seed, outage_from_s=4.0):
    """A push that is not measured from the fifth second on; error and reported sigma a second later."""
    rng = np.random.default_rng(seed)
    noise = NoiseModel(
        **{name: getattr(NOISE, name) for name in NOISE.__dataclass_fields__}
        | {"unseen_force_m_s2_rthz": 3e-3}
    )
    estimator = ErrorStateFilter(noise)
    estimator.begin_rest(0)
    v = p = 0.0
    for k in range(1, 601):
        t = 0.01 * k
        if k == 200:
            estimator.end_rest(round(t * 1e9))
        push = 3e-3 / 0.1 * rng.normal() if t > outage_from_s else 0.0  # white, of the stated density
        if t > outage_from_s:
            p += v * 0.01 + 0.5 * push * 1e-4
            v += push * 0.01
        if doubtful and k == round(outage_from_s * 100):
            estimator.doubt_forces(round(t * 1e9), x=True, y=False)
        reading = (0.0, 0.0)
        if doubtful and t > outage_from_s:
            made_up = estimator.expected_forces(0.0, (0.0, 0.0), 0.0)
            reading = (made_up[0], 0.0)
        noisy = 6.5e-4 * rng.normal(size=2)
        estimator.add_imu(
            ImuPacket(
                round(t * 1e9),
                0.01,
                6.7e-4 * rng.normal(),
                reading[0] + noisy[0],
                reading[1] + noisy[1],
                25.0,
            )
        )
        if k % 50 == 0 and t <= outage_from_s:
            estimator.add_fix(
                Fix(
                    round((t - 0.1) * 1e9),
                    round(t * 1e9),
                    *(1e-3 * rng.normal(size=2)),
                    9e-4 * rng.normal(),
                    COV,
                )
            )
    state = estimator.state()
    return state.x_m - p, state.sigma_x_m, math.sqrt(estimator.covariance()[0, 0])


def test_reported_sigmas_hold_what_acted_unseen():
    runs = np.array([flown(True, seed) for seed in range(40)])
    ratio = (runs[:, 0] / runs[:, 2]) ** 2
    assert 0.5 < ratio.mean() < 1.6
    assert np.allclose(runs[:, 1], runs[:, 2], rtol=0.2)  # the quick sigma agrees with the covariance
    assert (np.array([flown(False, seed)[2] for seed in range(3)]) < 0.5 * runs[:3, 2]).all()


def test_expected_forces_know_push_lever_and_spin():
    estimator = ErrorStateFilter(NOISE)
    x, y = estimator.expected_forces(0.5, (0.04, 0.01), 0.2)
    assert x == pytest.approx(0.04 + 0.2 * 0.02 - 0.25 * 0.03)
    assert y == pytest.approx(0.01 + 0.2 * 0.03 + 0.25 * 0.02)


def test_a_rest_in_doubt_teaches_no_bias():
    estimator = ErrorStateFilter(NOISE)
    estimator.begin_rest(0)
    estimator.doubt_forces(0, x=True, y=True)
    for k in range(1, 301):
        estimator.add_imu(ImuPacket(k * 10_000_000, 0.01, 0.0, 0.0, 0.0, 25.0))
    for k in (100, 290):
        estimator.add_fix(Fix(k * 10_000_000, 3_000_000_000, 0.0, 0.0, 0.0, COV))
    assert math.sqrt(estimator.P[es.ACC_BIAS_X, es.ACC_BIAS_X]) == pytest.approx(0.15, rel=1e-3)
