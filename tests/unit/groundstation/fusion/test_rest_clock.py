"""Only a rest without a break counts."""

import math

import numpy as np
import pytest

from groundstation.fusion.rest_clock import LANDING_S, LEAD_NS, QUIET_S, RestClock

MS = 1_000_000
S = 1_000_000_000
STEP_MS = 10
NULL = (0.03, 0.05, -0.02)


class Bench:
    """A block of the noise model's noise on a table, ten milliseconds a sample."""

    def __init__(self, noise, seed=1):
        self.noise = noise
        self.clock = RestClock(noise)
        self.rng = np.random.default_rng(seed)
        density = (noise.gyro_density_rad_s_rthz, *[noise.acc_density_m_s2_rthz] * 2)
        self.sigma = np.array(density) / math.sqrt(noise.packet_period_s)
        self.t_ms = 0
        self.changes = []

    def run(self, seconds, off=(0.0, 0.0, 0.0), **changes):
        """Give samples; ``off`` is a constant or a function of the time since the beginning."""
        for number in range(round(seconds * 1e3 / STEP_MS)):
            self.t_ms += STEP_MS
            move = off(number * STEP_MS * 1e-3) if callable(off) else off
            readings = np.array(NULL) + np.array(move) + self.sigma * self.rng.standard_normal(3)
            self.give(tuple(readings.tolist()), **changes)
        return self.clock.rest_s

    def give(self, readings, elapsed_s=STEP_MS * 1e-3, is_valid=True):
        now_ns = self.t_ms * MS
        self.note(self.clock.sample(now_ns, elapsed_s, readings, now_ns + 5 * MS, is_valid=is_valid))

    def note(self, change):
        if change is not None:
            self.changes.append(change)


@pytest.fixture
def bench(noise):
    return Bench(noise)


def test_a_rest_without_a_break_takes_its_time_and_no_longer(bench):
    assert bench.run(1.0) == 0.0  # it floats, as far as anybody knows
    bench.clock.land()
    assert bench.run(8.0) == pytest.approx(8.0, abs=0.02)
    assert [change.begins for change in bench.changes] == [True]


@pytest.mark.parametrize("seed", range(10))
def test_noise_and_a_null_that_warms_up_break_no_rest(noise, seed):
    bench = Bench(noise, seed)
    bench.clock.land()
    drift = (math.radians(0.02), 2e-4, -2e-4)  # per second
    assert bench.run(120.0, lambda t: tuple(t * d for d in drift)) == pytest.approx(120.0, abs=0.02)


def test_a_dead_block_rests_for_no_time(bench):
    bench.clock.land()
    for t_s in range(10):
        bench.note(bench.clock.check(t_s * S))
    assert bench.clock.rest_s == 0.0
    assert bench.changes == []


def test_a_block_that_dies_during_the_rest_ends_it(bench):
    bench.clock.land()
    bench.run(3.0)
    bench.note(bench.clock.check(bench.t_ms * MS + S // 4))
    assert bench.clock.rest_s > 2.9  # delivery may pause
    bench.note(bench.clock.check(bench.t_ms * MS + S))
    assert bench.clock.rest_s == 0.0
    assert bench.changes[-1] == (False, bench.t_ms * MS)


def test_samples_that_are_not_valid_are_no_rest(bench):
    bench.clock.land()
    assert bench.run(5.0, is_valid=False) == 0.0
    bench.run(3.0)
    bench.run(0.01, is_valid=False)
    assert bench.clock.rest_s == 0.0
    assert bench.run(2.0) == pytest.approx(2.0, abs=0.02)
    assert [change.begins for change in bench.changes] == [True, False, True]


@pytest.mark.parametrize(("elapsed_s", "breaks"), [(0.05, False), (0.051, True), (0.0, True)])
def test_a_gap_or_a_block_that_starts_anew_begins_the_rest_anew(bench, elapsed_s, breaks):
    bench.clock.land()
    bench.run(3.0)
    bench.t_ms += 50
    bench.give(NULL, elapsed_s)
    assert (bench.clock.rest_s == 0.0) is breaks
    assert bench.run(1.0) == pytest.approx(1.0 if breaks else 4.05, abs=0.03)


def test_a_stamp_that_goes_back_begins_the_rest_anew(bench):
    bench.clock.land()
    bench.run(3.0)
    bench.t_ms -= 1000
    bench.give(NULL)
    assert bench.clock.rest_s == 0.0


@pytest.mark.parametrize(
    "off",
    [
        (math.radians(3.0), 0.0, 0.0),
        (-math.radians(3.0), 0.0, 0.0),
        (0.0, 0.05, 0.0),
        (0.0, 0.0, -0.05),
        (0.0, 0.0, math.nan),
    ],
)
def test_one_sample_of_motion_begins_the_rest_anew(bench, off):
    bench.clock.land()
    bench.run(3.0)
    before_ns = bench.t_ms * MS
    bench.run(0.01, off)
    assert bench.clock.rest_s == 0.0
    assert bench.changes[-1] == (False, before_ns + STEP_MS * MS - LEAD_NS)
    assert bench.run(QUIET_S - 0.05) == 0.0
    assert bench.run(2.05) == pytest.approx(2.0, abs=0.03)


@pytest.mark.parametrize("off", [(math.radians(0.4), 0.0, 0.0), (0.0, 0.008, 0.0), (0.0, 0.0, -0.008)])
def test_slow_motion_is_seen_in_smoothed_readings(bench, off):
    bench.clock.land()
    bench.run(3.0)
    bench.run(0.5, off)
    assert [change.begins for change in bench.changes] == [True, False]


def test_a_block_lifted_by_hand_does_not_rest_before_it_is_put_down(bench):
    bench.clock.land()
    bench.run(5.0)

    def hand(t):
        return 0.3 * math.sin(2.0 * t), 0.4 * math.sin(3.0 * t), 0.5 * math.sin(2.5 * t)

    assert bench.run(6.0, hand) == 0.0
    assert sum(change.begins for change in bench.changes) == 1
    assert bench.run(8.0 + QUIET_S) == pytest.approx(8.0, abs=0.3)
    assert [change.begins for change in bench.changes] == [True, False, True]


def test_a_break_never_lies_before_the_beginning(bench):
    bench.clock.land()
    bench.run(0.05)
    bench.run(0.01, (1.0, 0.0, 0.0))
    begun, over = bench.changes
    assert over.t_ns == begun.t_ns


def test_after_take_off_the_length_stays_and_a_landing_begins_anew(bench):
    bench.clock.land()
    rest_s = bench.run(3.0)
    bench.note(bench.clock.float_up(bench.t_ms * MS + 3))
    assert bench.changes[-1] == (False, bench.t_ms * MS + 3)
    assert bench.clock.float_up(bench.t_ms * MS + 4) is None
    assert bench.run(5.0, (0.4, 0.2, 0.1)) == rest_s
    bench.note(bench.clock.check(bench.t_ms * MS + 9 * S))
    assert bench.clock.rest_s == rest_s
    bench.clock.land()
    assert bench.clock.rest_s == 0.0
    assert bench.run(LANDING_S + 2.0) == pytest.approx(2.0, abs=0.03)
    bench.clock.land()  # stated again and again
    assert bench.clock.rest_s == pytest.approx(2.0, abs=0.03)
