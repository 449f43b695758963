"""The clock against a simulated link: a block, its serial line, an FTDI chip and a busy host."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from unit.drivers.imu_block.imu_links import Link, assert_stamps_keep_their_promises, fly

from drivers.imu_block.clock import TickClock
from drivers.imu_block.lower_envelope import DRIFT_LIMIT, LowerEnvelope, Point
from drivers.imu_block.protocol import encode_ping


@pytest.mark.parametrize("drift", [-100e-6, -20e-6, 20e-6, 100e-6])
@pytest.mark.parametrize(
    ("link", "limit_s"),
    [
        (Link(sample_count=4, timer_s=0.016), 0.0003),  # full packets
        (Link(sample_count=4, timer_s=0.001), 0.0006),
        (Link(sample_count=1, timer_s=0.016, duration_s=12), 0.0003),
        (Link(sample_count=4, timer_s=0.016, jitter_s=0.003), 0.0005),
        (Link(sample_count=4, timer_s=0.001, stall_every_s=2.3, stall_s=0.2, jitter_s=0.001), 0.0008),
    ],
    ids=["62 bytes in 16 ms", "timer 1 ms", "1 kHz", "3 ms of jitter", "host stalls"],
)
def test_stamps_are_right_to_under_a_millisecond_where_the_link_lets_them(link, limit_s, drift):
    flight = fly(Link(**{**vars(link), "drift": drift, "start_ns": 7_500_000_000}))
    assert_stamps_keep_their_promises(flight)
    assert np.abs(flight.error_s[flight.locked_from :]).max() < limit_s
    assert flight.sigma_s[-1] < 0.001
    assert abs(flight.clock.drift_ratio - drift) < 20e-6


@pytest.mark.parametrize("baud", [250_000, 115_200])
@pytest.mark.parametrize(("sample_count", "least_s"), [(8, 0.0001), (10, 0.001)])
def test_a_slow_v1_stream_states_the_delay_that_no_host_can_see(baud, sample_count, least_s):
    flight = fly(Link(version=1, sample_count=sample_count, baud=baud))  # 8: packets end within a frame
    assert_stamps_keep_their_promises(flight)
    settled = flight.error_s[flight.locked_from :]
    assert least_s < flight.sigma_s[-1] < 0.004
    assert np.std(settled) < 0.0002  # constant, so the camera-delay calibration can remove it
    assert np.abs(settled).max() < 0.0004  # where the timer starts with the first byte that waits


@pytest.mark.parametrize("seed", range(12))
def test_the_stated_deviation_covers_the_error_on_any_link(seed):
    rng = np.random.default_rng(seed)
    link = Link(
        version=int(rng.integers(1, 3)),
        sample_count=int(rng.choice([1, 2, 3, 4, 5, 8, 10, 20])),
        timer_s=float(rng.choice([0.001, 0.004, 0.016])),
        drift=rng.uniform(-100e-6, 100e-6),
        jitter_s=rng.uniform(0.0, 0.003),
        seed=seed,
        duration_s=8,
    )
    assert_stamps_keep_their_promises(fly(link))


def test_ticks_unwrap_over_the_16_bit_limit_and_elapsed_ticks_say_what_was_lost():
    link = Link(first_tick=65000, duration_s=6)
    link.run()
    stamps = fly(link).stamps
    assert [stamp.tick for stamp in stamps] == list(range(65004, 65000 + 4 * len(stamps) + 1, 4))
    assert {stamp.elapsed_ticks for stamp in stamps[1:]} == {4}
    assert {stamp.epoch for stamp in stamps} == {0}


@pytest.mark.parametrize("version", [1, 2])
@pytest.mark.parametrize("gap_s", [0.48, 70.0, 200.0])
def test_a_gap_in_the_data_is_measured_by_host_time_where_the_counter_wrapped(version, gap_s):
    sample_count = 8
    first, second = (
        Link(version=version, sample_count=sample_count, duration_s=5),
        Link(version=version, sample_count=sample_count, duration_s=5),
    )
    ticks = int(gap_s * 1000)
    second.first_tick = 5000 + ticks
    second.start_ns = first.start_ns + round((5 + gap_s) * 1e9 * (1 + first.drift))
    second.first_sequence = (5000 + ticks) // sample_count
    flight = fly(first, second)
    assert flight.stamps[-1].epoch == 0
    jump = max(stamp.elapsed_ticks for stamp in flight.stamps[1:])
    assert jump == ticks + sample_count


@pytest.mark.parametrize("version", [1, 2])
@pytest.mark.parametrize("ran_s", [4.0, 20.0])
def test_a_restarted_block_begins_a_new_epoch_and_stamps_stay_monotone(version, ran_s):
    first = Link(version=version, sample_count=8, duration_s=ran_s)
    second = Link(
        version=version, sample_count=8, duration_s=12, start_ns=first.start_ns + round((ran_s + 2.3) * 1e9)
    )
    flight = fly(first, second)
    assert flight.clock.epoch == 1
    steps = np.diff([stamp.stamp_ns for stamp in flight.stamps])
    assert (steps > 0).all()
    restarts = [stamp for stamp in flight.stamps[1:] if stamp.elapsed_ticks is None]
    assert len(restarts) == 1
    assert abs(flight.error_s[-1]) < 2.5 * flight.sigma_s[-1]


def test_replies_between_frames_do_not_pull_the_clock():
    link = Link(sample_count=4, timer_s=0.001).run()
    ping = encode_ping(1)  # stands for any packet that is no sample
    disturbed = Link(sample_count=4, timer_s=0.001)
    disturbed.truth_ns = link.truth_ns
    disturbed.reads = [(a, chunk + ping if i % 3 == 0 else chunk) for i, (a, chunk) in enumerate(link.reads)]
    disturbed.run = lambda: disturbed
    flight = fly(disturbed)
    assert np.abs(flight.error_s[flight.locked_from :]).max() < 0.0008


@pytest.mark.slow
def test_ten_minutes_at_500_frames_stay_right_and_monotone():
    flight = fly(
        Link(
            sample_count=2, duration_s=600, drift=83e-6, stall_every_s=7.1, stall_s=0.05, start_ns=5 * 10**12
        )
    )
    assert_stamps_keep_their_promises(flight)
    assert np.abs(flight.error_s[flight.locked_from :]).max() < 0.0004
    assert flight.clock.drift_ratio == pytest.approx(83e-6, abs=2e-6)


def test_a_clock_without_sense_is_refused():
    with pytest.raises(ValueError, match="must be positive"):
        TickClock(0)


@settings(max_examples=50, deadline=None)
@given(
    offset=st.floats(-1e9, 1e9),
    drift=st.floats(-100e-6, 100e-6),
    delays=st.lists(st.floats(0, 1e7), min_size=20, max_size=300),
)
def test_the_envelope_lies_under_every_recent_point(offset, drift, delays):
    envelope = LowerEnvelope()
    points = [(k * 1e8, offset + drift * k * 1e8 + delay) for k, delay in enumerate(delays)]
    for x, y in points:
        envelope.add(Point(x, y))
        assert envelope.height_ns(x) <= y + 1.0
    assert all(envelope.height_ns(x) <= y + 1.0 for x, y in points)
    assert abs(envelope.drift) <= DRIFT_LIMIT
