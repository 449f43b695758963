# ruff: noqa: N806 - P as in the literature

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.fusion.error_state_filter import ErrorStateFilter
from groundstation.fusion.estimator import Fix, ImuPacket
from groundstation.fusion.noise import NoiseModel, packet_density

MS = 1_000_000


def a_noise(**changes) -> NoiseModel:
    figures = {
        "packet_period_s": 0.01,
        "gyro_density_rad_s_rthz": packet_density(1.75e-3, 4.26e-3, 1000.0),
        "acc_density_m_s2_rthz": packet_density(2e-3, 1.25e-3, 1000.0),
        "star_sigma_xy_m": 1e-3,
        "star_sigma_heading_rad": 8.7e-4,
    }
    return NoiseModel(**(figures | changes))


COV = np.diag([1e-6, 1e-6, 7.6e-7])


def a_fix(t_ms: int, x: float = 0.0, y: float = 0.0, heading: float = 0.0, late_ms: int = 600) -> Fix:
    return Fix(t_ms * MS, (t_ms + late_ms) * MS, x, y, heading, COV)


def packets(start_ms: int, stop_ms: int, rate=0.0, ax=0.0, ay=0.0):
    for t in range(start_ms + 10, stop_ms + 1, 10):
        yield ImuPacket(t * MS, 0.01, rate, ax, ay, 25.0)


def rested(noise: NoiseModel | None = None, seconds: int = 4) -> ErrorStateFilter:
    """A filter that has rested at the origin and may now fly."""
    estimator = ErrorStateFilter(noise or a_noise())
    estimator.begin_rest(0)
    rng = np.random.default_rng(1)
    for t in range(10, seconds * 1000 + 1, 10):
        noisy = rng.normal(0.0, [7e-4, 6e-4, 6e-4])
        estimator.add_imu(ImuPacket(t * MS, 0.01, *noisy, 25.0))
        if t % 670 == 0 and t > 700:
            estimator.add_fix(a_fix(t - 600))
    estimator.end_rest(seconds * 1000 * MS)
    return estimator


def test_no_state_before_two_fixes_agree():
    estimator = ErrorStateFilter(a_noise())
    estimator.begin_rest(0)
    assert all(estimator.add_imu(p) is None for p in packets(0, 1000))
    assert estimator.add_fix(a_fix(300, 1.0, 2.0, 3.0)).reason == "waits for a second fix"
    assert estimator.add_fix(a_fix(500, -1.0, 0.5, 0.0)).reason == "waits for a second fix"
    assert estimator.state() is None
    assert estimator.add_fix(a_fix(800, 1.001, 2.001, 3.0)).used
    state = estimator.state()
    assert state.x_m == pytest.approx(1.0, abs=2e-3)
    assert not state.is_lost
    settled = {a.t_exposure_ns // MS: a for a in estimator.settled()}
    assert settled[300].used
    assert not settled[500].used


def test_a_wrong_first_fix_does_not_bend_the_biases():
    estimator = ErrorStateFilter(a_noise())
    estimator.begin_rest(0)
    for p in packets(0, 3000, ax=0.05):
        estimator.add_imu(p)
    estimator.add_fix(a_fix(300, 0.5, 0.5, 2.0))
    for t in (900, 1600, 2300):
        estimator.add_fix(a_fix(t))
    assert estimator.state().bias_ax_m_s2 == pytest.approx(0.05, abs=1e-3)
    assert estimator.state().bias_ay_m_s2 == pytest.approx(0.0, abs=1e-3)


@settings(max_examples=12, deadline=None)
@given(late_ms=st.integers(0, 150).map(lambda k: k * 10), turn=st.floats(-0.5, 0.5))
def test_a_late_fix_gives_the_state_that_a_prompt_one_would_have_given(late_ms, turn):
    prompt, late = rested(seconds=2), rested(seconds=2)
    fix = Fix(2500 * MS, (2500 + late_ms) * MS, 0.003, -0.002, 0.5 * turn + 0.001, COV)
    for p in packets(2000, 4000, rate=turn, ax=0.01, ay=-0.005):
        for estimator, arrival in ((prompt, 2500), (late, 2500 + late_ms)):
            estimator.add_imu(p)
            if p.t_ns == arrival * MS:
                assert estimator.add_fix(fix).used
    # up to where exactly the local slope ahead was looked up
    np.testing.assert_allclose(late.state()[1:13], prompt.state()[1:13], rtol=1e-6, atol=2e-8)


def test_a_fix_ahead_of_the_packets_waits_for_them():
    estimator = rested()
    account = estimator.add_fix(a_fix(4015, 0.001, 0.0, 0.0, late_ms=5))
    assert account.reason == "waits for packets"
    for p in packets(4000, 4020):
        estimator.add_imu(p)
    assert estimator.settled()[-1].used


def test_the_reported_state_is_the_centre_of_mass_in_a_spin():
    estimator = rested(a_noise(imu_offset_x_m=0.03, imu_offset_y_m=-0.02))
    # the accelerometers feel the pull towards the centre, which itself stands still
    rate = 0.7
    pull = (-(rate**2) * 0.03, rate**2 * 0.02)
    alpha = rate / 0.5
    spin_up = (-alpha * -0.02, alpha * 0.03)
    for k in range(50):
        w = (k + 0.5) / 50 * rate
        felt = (spin_up[0] - w**2 * 0.03, spin_up[1] + w**2 * 0.02)
        estimator.add_imu(ImuPacket((4010 + 10 * k) * MS, 0.01, w, *felt, 25.0))
    for p in packets(4500, 8500, rate, *pull):
        state = estimator.add_imu(p)
    assert math.hypot(state.x_m, state.y_m) < 0.003
    assert math.hypot(state.vx_m_s, state.vy_m_s) < 0.002


def test_a_gross_fix_is_refused_with_its_innovation():
    estimator = rested()
    for p in packets(4000, 5000):
        estimator.add_imu(p)
    before = estimator.state()
    account = estimator.add_fix(a_fix(4300, 0.4, -0.2, 1.0))
    assert not account.used
    assert account.reason == "outside the gate"
    assert account.innovation_x_m == pytest.approx(0.4, abs=0.005)
    assert estimator.state() == before


def test_a_vehicle_that_was_carried_away_is_found_again():
    estimator = rested()
    t = 4000
    for k in range(12):
        for p in packets(t, t + 670):
            estimator.add_imu(p)
        t += 670
        account = estimator.add_fix(a_fix(t - 600, 0.5, 0.3, 0.4))
        if k == 2:
            assert not account.used
    assert account.used
    assert estimator.state().x_m == pytest.approx(0.5, abs=0.003)
    assert not estimator.state().is_lost
    assert estimator.counters.by_name["fix_starts_the_estimate_again"] == 1


def test_wrong_fixes_that_contradict_each_other_do_not_move_it():
    estimator = rested()
    rng = np.random.default_rng(3)
    t = 4000
    for _ in range(9):
        for p in packets(t, t + 670):
            estimator.add_imu(p)
        t += 670
        estimator.add_fix(a_fix(t - 600, *rng.uniform(-1, 1, 3)))
    assert estimator.state().is_lost
    assert math.hypot(estimator.state().x_m, estimator.state().y_m) < 0.05


def test_a_landing_stops_the_vehicle_and_sharpens_the_biases():
    estimator = rested()
    for p in packets(4000, 5000, ax=0.02):
        estimator.add_imu(p)
    assert estimator.state().vx_m_s > 0.01
    estimator.begin_rest(5000 * MS)
    t = 5000
    while t < 10000:
        for p in packets(t, t + 500):
            estimator.add_imu(p)
        t += 500
        estimator.add_fix(a_fix(t - 400, 0.01))
    state = estimator.state()
    assert state.vx_m_s == 0.0
    assert state.x_m == pytest.approx(0.01, abs=1e-3)
    assert np.sqrt(estimator.P[5, 5]) < 5e-5


def test_the_covariance_agrees_with_the_reported_sigmas():
    estimator = rested()
    for p in packets(4000, 4600):
        estimator.add_imu(p)
    estimator.add_fix(a_fix(4000))
    P = estimator.covariance()
    state = estimator.state()
    np.testing.assert_allclose(np.sqrt(np.diag(P)[:3]), state[10:13], rtol=0.02)
    assert (np.linalg.eigvalsh(P) > 0.0).all()


@pytest.mark.parametrize("rate_hz", [100, 250, 1000])
@pytest.mark.parametrize(("every_ms", "late_ms"), [(670, 600), (70, 30)])
def test_any_rates_of_packets_and_fixes_do(rate_hz, every_ms, late_ms):
    rng = np.random.default_rng(rate_hz + every_ms)
    period_ms = 1000 // rate_hz
    noise = a_noise(packet_period_s=period_ms / 1000)
    estimator = ErrorStateFilter(noise)
    estimator.begin_rest(0)
    sigma = np.array([noise.gyro_density_rad_s_rthz, *[noise.acc_density_m_s2_rthz] * 2]) * math.sqrt(rate_hz)
    for t in range(period_ms, 8001, period_ms):
        if t == 3000:
            estimator.end_rest(3000 * MS)
        estimator.add_imu(ImuPacket(t * MS, period_ms / 1000, *rng.normal(0.0, sigma), 25.0))
        if t > late_ms and (t - late_ms) % every_ms == 0:
            pose = rng.normal(0.0, [1e-3, 1e-3, 8.7e-4])
            estimator.add_fix(a_fix(t - late_ms, *pose, late_ms=late_ms))
    state = estimator.state()
    assert math.hypot(state.x_m, state.y_m) < 4e-3
    assert state.sigma_x_m < 2.5e-3
