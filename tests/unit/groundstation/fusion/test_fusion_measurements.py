# ruff: noqa: N806 - F, P, Q, H as in the literature

from dataclasses import replace

import numpy as np
import pytest

from groundstation.fusion import error_state as es
from groundstation.fusion import measurements
from groundstation.fusion.estimator import Fix
from groundstation.fusion.late_fix import LateFix
from groundstation.fusion.packet_history import Segment


@pytest.fixture
def x(noise):
    state = es.initial_state(noise)
    state[: es.MOVING] = 0.8, 0.05, -0.02, 0.3, 0.4
    return state


@pytest.mark.parametrize("lag_s", [0.0, 0.008])
def test_the_jacobian_of_a_fix_is_the_derivative_of_its_innovation(noise, fix_covariance, x, lag_s):
    lagging = replace(noise, gyro_lag_s=lag_s, acc_lag_s=2 * lag_s)
    fix = Fix(0, 0, 0.3, 0.4, 0.8, fix_covariance)
    _, H = measurements.predict_fix(fix, x, 0.3, lagging)
    for k in range(es.SIZE):
        step = np.zeros(es.SIZE)
        step[k] = 1e-6
        ahead, _ = measurements.predict_fix(fix, x + step, 0.3, lagging)
        back, _ = measurements.predict_fix(fix, x - step, 0.3, lagging)
        np.testing.assert_allclose(H[:, k], -(ahead - back) / 2e-6, atol=1e-3)


def test_a_pose_taken_from_a_fix_predicts_that_fix(noise, fix_covariance, x):
    P = np.diag(es.initial_variance(noise))
    fix = Fix(0, 0, -0.2, 0.7, 2.9, fix_covariance)
    measurements.take_pose(fix, x, P, 2 * np.pi, 0.1)
    z, H = measurements.predict_fix(fix, x, 0.0, noise)
    np.testing.assert_allclose(z, 0.0, atol=1e-12)
    assert abs(x[es.THETA] - 2 * np.pi) <= np.pi
    # what the fix knows of the body's origin is what the state now knows of it
    np.testing.assert_allclose(H @ P @ H.T, fix_covariance, atol=1e-15)


def test_a_rest_on_a_slope_gives_bias_less_slope_and_leaves_their_split_open(noise, x):
    rng = np.random.default_rng(5)
    n = 1000
    P = np.diag(es.initial_variance(noise))
    P[: es.MOVING] = P[:, : es.MOVING] = 0.0
    sigma = noise.acc_density_m_s2_rthz / 0.1
    c, s = np.cos(x[0]), np.sin(x[0])
    bias, slope = np.array([0.03, -0.05]), np.array([2e-3, -1e-3])
    felt = bias - np.array([c * slope[0] + s * slope[1], -s * slope[0] + c * slope[1]])
    t = np.arange(1, n + 1) * 0.01
    rest = Segment(
        t, np.full(n, 0.01), rng.normal(0.01, 7e-4, n), rng.normal(felt[0], sigma, n),
        rng.normal(felt[1], sigma, n), np.zeros(n), np.zeros(n), 0.0, t[-1],
    )  # fmt: skip
    assert measurements.learn_rest(x, P, rest, noise) is not None
    H = np.zeros((2, es.SIZE))
    H[0, 6] = H[1, 7] = 1.0
    for k in (8, 13):
        H[0, k : k + 2] = -c, -s
        H[1, k : k + 2] = s, -c
    left = H @ x - felt
    assert np.abs(left).max() < 5 * sigma / np.sqrt(n)
    assert np.sqrt((H @ P @ H.T)[0, 0]) < 1.1 * sigma / np.sqrt(n)
    assert np.sqrt(P[es.SLOPE_X, es.SLOPE_X]) > 0.9 * noise.slope_sigma_m_s2


def test_a_rest_between_fast_fixes_is_learned_packet_by_packet(noise, x):
    """With 50 fixes and 100 packets a second two packets lie between two fixes: still a rest."""
    P = np.diag(es.initial_variance(noise))
    zero = np.zeros(2)
    for k in range(200):
        rest = Segment(
            np.array([0.01, 0.02]) + 0.02 * k, np.full(2, 0.01), zero, np.full(2, 0.02), zero, zero, zero,
            0.02 * k, 0.02 * k + 0.02,
        )  # fmt: skip
        assert measurements.learn_rest(x, P, rest, noise) is not None
    sigma = noise.acc_density_m_s2_rthz / 0.1 / np.sqrt(400)
    c, s = np.cos(x[es.THETA]), np.sin(x[es.THETA])
    gx, gy = x[es.SLOPE_X] + x[es.WAVE_X], x[es.SLOPE_Y] + x[es.WAVE_Y]
    assert x[es.ACC_BIAS_X] - (c * gx + s * gy) == pytest.approx(0.02, abs=5 * sigma)


def test_no_packets_are_no_rest(noise, x):
    none = np.zeros(0)
    empty = Segment(none, none, none, none, none, none, none, 0.0, 0.02)
    assert measurements.learn_rest(x, np.diag(es.initial_variance(noise)), empty, noise) is None


def test_a_touched_vehicle_is_not_at_rest(noise, x):
    P = np.diag(es.initial_variance(noise))
    before = x.copy()
    n = 100
    push = np.where(np.arange(n) > 50, 0.05, 0.0)
    zero = np.zeros(n)
    touched = Segment(np.arange(1, n + 1) * 0.01, np.full(n, 0.01), zero, push, zero, zero, zero, 0.0, 1.0)
    with pytest.raises(measurements.RestDisturbed):
        measurements.learn_rest(x, P, touched, noise)
    np.testing.assert_array_equal(x, before)


def test_reported_variances_follow_the_covariance_over_seconds(noise, x):
    rng = np.random.default_rng(0)
    A = rng.normal(0.0, 1.0, (es.SIZE, es.SIZE)) * 1e-4
    P = A @ A.T
    poly = LateFix(noise).variance_in_time(x, P, noise)
    H = measurements.reported(x, 0.0)
    assert poly[0] == pytest.approx((H @ P @ H.T)[0, 0])
    assert poly[10] == pytest.approx(P[0, 0])


def test_a_turning_vehicles_heading_grows_uncertain_by_the_gyros_scale_too(noise, x):
    rng = np.random.default_rng(8)
    A = 1e-3 * rng.normal(size=(es.SIZE, es.SIZE))
    P, w, tau = A @ A.T, 0.7, 0.8
    poly = LateFix(noise).variance_in_time(x, P, noise)
    measurements.add_scale_in_time(poly, P, w)
    grown = np.zeros(es.SIZE)  # the heading's error after tau, from the error states
    grown[[es.THETA, es.GYRO_BIAS, es.GYRO_SCALE]] = 1.0, -tau, -w * tau
    want = grown @ P @ grown + noise.gyro_density_rad_s_rthz**2 * tau
    assert poly[10] + tau * (poly[11] + tau * poly[12]) == pytest.approx(want)
