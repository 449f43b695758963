"""Whatever arrives, the filter survives it with a counter, and its state stays finite."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.fusion.error_state_filter import ErrorStateFilter
from groundstation.fusion.estimator import Fix, ImuPacket
from groundstation.fusion.stamp_ticks import StampTicks

MS = 1_000_000


@pytest.fixture
def flying(noise, fix_covariance):
    estimator = ErrorStateFilter(noise)
    estimator.begin_rest(0)
    for t in range(10, 3001, 10):
        estimator.add_imu(ImuPacket(t * MS, 0.01, 0.0, 0.0, 0.0, 25.0))
        if t in (1000, 2000):
            estimator.add_fix(Fix((t - 600) * MS, t * MS, 0.0, 0.0, 0.0, fix_covariance))
    estimator.end_rest(3000 * MS)
    return estimator


def test_duplicated_and_older_packets_are_refused_and_counted(flying):
    before = flying.state()
    assert flying.add_imu(ImuPacket(3000 * MS, 0.01, 1.0, 1.0, 1.0, 25.0)) is None
    assert flying.add_imu(ImuPacket(2990 * MS, 0.01, 1.0, 1.0, 1.0, 25.0)) is None
    assert flying.counters.by_name["packet_stamp_not_after_the_last"] == 2
    assert flying.state() == before


def test_a_clock_that_jumped_back_for_good_is_followed(flying, fix_covariance):
    for t in range(100_010, 100_500, 10):
        flying.add_imu(ImuPacket(t * MS - 99_000 * MS, 0.01, 0.0, 0.0, 0.0, 25.0))
    assert flying.counters.by_name["clock_jumped_back"] == 1
    state = flying.state()
    assert state.t_ns == 1490 * MS
    assert flying.add_fix(Fix(1400 * MS, 1490 * MS, 0.001, 0.0, 0.0, fix_covariance)).used


def test_a_hole_is_bridged_and_widens_the_sigmas(flying):
    narrow = flying.state().sigma_x_m
    state = flying.add_imu(ImuPacket(3500 * MS, 0.5, 0.0, 0.0, 0.0, 25.0))
    assert flying.counters.by_name["packet_hole"] == 1
    assert state.sigma_x_m > narrow
    assert math.hypot(state.x_m, state.y_m) < 0.01


@pytest.mark.parametrize("hole_ms", [300, 500, 1500])
@pytest.mark.parametrize("sudden", [0.0, 0.3])
def test_a_vehicle_that_turned_faster_in_a_hole_is_where_it_is_within_three_sigma(flying, hole_ms, sudden):
    faster = math.radians(10.0) * hole_ms * 1e-3
    for t in range(3010, 3501, 10):
        narrow = flying.add_imu(ImuPacket(t * MS, 0.01, 0.0, 0.0, 0.0, 25.0)).sigma_heading_rad
    for k in range(101):
        t = 3500 + hole_ms + 10 * k
        dt_s = 1e-3 * hole_ms if k == 0 else 0.01
        state = flying.add_imu(ImuPacket(t * MS, dt_s, faster, 0.0, 0.0, 25.0))
        # evenly in the hole, or all of it some way off its middle
        turned = faster * ((0.5 + sudden) * 1e-3 * hole_ms + 0.01 * k)
        if k in (0, 30, 100):
            assert abs(state.heading_rad - turned) < 3.0 * state.sigma_heading_rad + 1e-4
            assert abs(state.rate_rad_s - faster) < 2e-3
            assert not state.is_lost
    assert "packet_wild" not in flying.counters.by_name
    assert state.sigma_heading_rad > narrow


def test_a_long_hole_in_flight_is_called_lost_until_a_fix_agrees(flying, fix_covariance):
    state = flying.add_imu(ImuPacket(8000 * MS, 5.0, 0.0, 0.0, 0.0, 25.0))
    assert state.is_lost
    assert flying.counters.by_name["packets_missing_for_long"] == 1
    assert flying.add_fix(Fix(8000 * MS, 8000 * MS, 0.0, 0.0, 0.0, fix_covariance)).used
    assert not flying.add_imu(ImuPacket(8010 * MS, 0.01, 0.0, 0.0, 0.0, 25.0)).is_lost


def test_ticks_that_contradict_the_stamps_are_counted_and_the_stamps_win(flying):
    state = flying.add_imu(ImuPacket(4000 * MS, 0.01, 0.0, 0.0, 0.0, 25.0))
    assert flying.counters.by_name["packet_ticks_and_stamps_disagree"] == 1
    assert state.t_ns == 4000 * MS


def test_a_fix_before_the_first_packet_is_refused(noise, fix_covariance):
    estimator = ErrorStateFilter(noise)
    assert estimator.add_fix(Fix(0, 0, 0.0, 0.0, 0.0, fix_covariance)).reason == "before the first packet"
    estimator.add_imu(ImuPacket(5000 * MS, 0.01, 0.0, 0.0, 0.0, 25.0))
    account = estimator.add_fix(Fix(100 * MS, 5000 * MS, 0.0, 0.0, 0.0, fix_covariance))
    assert account.reason == "before the first packet"
    assert estimator.counters.by_name["fix_before_the_first_packet"] == 2


def test_a_fix_out_of_order_is_refused(flying, fix_covariance):
    account = flying.add_fix(Fix(1000 * MS, 3000 * MS, 0.0, 0.0, 0.0, fix_covariance))
    assert account.reason == "older than the last used"


def test_a_fix_from_the_future_is_refused(flying, fix_covariance):
    account = flying.add_fix(Fix(9000 * MS, 3000 * MS, 0.0, 0.0, 0.0, fix_covariance))
    assert account.reason == "more than a second ahead of the packets"


def test_a_block_without_thermometer_is_fine(noise, fix_covariance):
    estimator = ErrorStateFilter(noise)
    estimator.begin_rest(0)
    for t in range(10, 3001, 10):
        estimator.add_imu(ImuPacket(t * MS, 0.01, 0.0, 0.0, 0.0, math.nan))
        if t in (1000, 2000):
            estimator.add_fix(Fix((t - 600) * MS, t * MS, 0.0, 0.0, 0.0, fix_covariance))
    assert np.isfinite(estimator.state()[1:13]).all()


anything = st.floats(allow_nan=True, allow_infinity=True, width=32)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(
        st.tuples(st.integers(-200, 400), anything, anything, anything, anything, st.booleans()), max_size=40
    )
)
def test_no_sequence_of_readings_makes_the_state_anything_but_finite(events):
    from groundstation.fusion.noise import NoiseModel

    noise = NoiseModel(
        packet_period_s=0.01, gyro_density_rad_s_rthz=7e-5, acc_density_m_s2_rthz=6e-5,
        star_sigma_xy_m=1e-3, star_sigma_heading_rad=8.7e-4,
    )  # fmt: skip
    covariance = np.diag([1e-6, 1e-6, 7.6e-7])
    estimator = ErrorStateFilter(noise)
    estimator.begin_rest(0)
    for t in range(10, 1501, 10):
        estimator.add_imu(ImuPacket(t * MS, 0.01, 0.0, 0.0, 0.0, 25.0))
    estimator.add_fix(Fix(300 * MS, 900 * MS, 0.0, 0.0, 0.0, covariance))
    estimator.add_fix(Fix(900 * MS, 1500 * MS, 0.0, 0.0, 0.0, covariance))
    estimator.end_rest(1500 * MS)
    t = 1500
    for step, a, b, c, d, is_fix in events:
        t += step
        if is_fix:
            estimator.add_fix(Fix((t - 300) * MS, t * MS, a, b, c, covariance))
        else:
            estimator.add_imu(ImuPacket(t * MS, max(step, 1) / 1000, a, b, c, d))
    assert np.isfinite(estimator.state()[1:13]).all()
    assert np.isfinite(estimator.covariance()).all()


@given(st.lists(st.integers(1, 12), min_size=1, max_size=60), st.integers(0, 2**32 - 1))
def test_ticks_are_recovered_from_jittering_stamps(windows, seed):
    rng = np.random.default_rng(seed)
    ticks = StampTicks(0.01)
    ticks.elapsed_s(0.01)
    k = 1
    for n in windows:
        k += n
        stamp = 0.01 * k + float(np.clip(rng.normal(0.0, 3e-4), -1e-3, 1e-3))
        assert ticks.elapsed_s(stamp) == pytest.approx(0.01 * n)


@pytest.mark.parametrize("ahead_s", [10, 600, 100_000, 1_760_000_000])
@pytest.mark.parametrize("wild", [1, 2])
def test_stamps_far_ahead_of_the_ticks_are_not_acted_on(flying, ahead_s, wild, fix_covariance):
    for t in range(3010, 3010 + 10 * wild, 10):
        assert flying.add_imu(ImuPacket((t + 1000 * ahead_s) * MS, 0.01, 0.0, 0.0, 0.0, 25.0)) is None
    assert flying.counters.by_name["packet_stamp_far_ahead_of_the_ticks"] == wild
    state = flying.add_imu(ImuPacket((3010 + 10 * wild) * MS, 0.01, 0.0, 0.0, 0.0, 25.0))
    assert not state.is_lost
    assert math.hypot(state.x_m, state.y_m) < 1e-3
    assert flying.add_fix(Fix(3000 * MS, 3600 * MS, 0.0, 0.0, 0.0, fix_covariance)).used


def test_a_clock_set_ahead_is_followed_when_three_packets_say_so_and_the_filter_is_lost(
    flying, fix_covariance
):
    states = [
        flying.add_imu(ImuPacket((63_000 + t) * MS, 0.01, 0.0, 0.0, 0.0, 25.0)) for t in range(10, 100, 10)
    ]
    assert states[:2] == [None, None]
    assert all(state.is_lost for state in states[2:])
    assert states[2].sigma_x_m > 10.0  # a minute at the speed of anything on a table
    one = flying.add_fix(Fix(63_050 * MS, 63_090 * MS, 0.5, 0.0, 0.0, fix_covariance))
    assert not one.used  # a second one must agree
    assert flying.add_fix(Fix(63_080 * MS, 63_090 * MS, 0.5, 0.0, 0.0, fix_covariance)).used
    found = flying.add_imu(ImuPacket(63_100 * MS, 0.01, 0.0, 0.0, 0.0, 25.0))
    assert not found.is_lost
    assert found.x_m == pytest.approx(0.5, abs=0.005)
