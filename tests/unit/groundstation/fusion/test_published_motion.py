"""The published estimators: what each goes by, and from where it integrates."""

import math
from dataclasses import replace

import pytest

from groundstation.fusion.estimator import Fix, ImuPacket
from groundstation.fusion.estimators import PUBLISHED
from groundstation.fusion.published_motion import STARTED
from groundstation.fusion.published_settings import PublishedMotion
from groundstation.fusion.published_steps import Moving, stepped

NS = 1_000_000_000
ZERO = (0.02, 0.03, -0.05)  # rate, ax, ay of the rest
PUSH = (0.1, 0.04, 0.02)


class Flight:
    """One second at rest by packets of 0.1 s, then a push."""

    def __init__(self, method, noise, fix_covariance, settings=None, last_of_rest=ZERO):
        on_the_vertical = replace(noise, imu_offset_x_m=0.0, imu_offset_y_m=0.0)
        self.covariance = fix_covariance
        self.estimator = PUBLISHED[method](on_the_vertical, settings or PublishedMotion())
        self.estimator.begin_rest(0)
        self.states = []
        for number in range(1, 11):
            self.packet(0.1 * number, ZERO if number < 10 else last_of_rest)

    def packet(self, t_s, reading, dt_s=0.1):
        self.states.append(self.estimator.add_imu(ImuPacket(round(t_s * NS), dt_s, *reading, 20.0)))
        return self.states[-1]

    def push(self, t_s, dt_s=0.1):
        return self.packet(t_s, tuple(zero + more for zero, more in zip(ZERO, PUSH, strict=True)), dt_s)

    def fix(self, t_s, x_m, y_m, heading_rad):
        stamp_ns = round(t_s * NS)
        return self.estimator.add_fix(Fix(stamp_ns, stamp_ns, x_m, y_m, heading_rad, self.covariance))

    def take_off(self):
        self.estimator.end_rest(NS)


@pytest.fixture
def flight(noise, fix_covariance):
    def make(method, **words):
        return Flight(method, noise, fix_covariance, **words)

    return make


def pose_of(state):
    return (state.heading_rad, state.vx_m_s, state.vy_m_s, state.x_m, state.y_m)


def test_joint_begins_at_once_from_rough_conditions_that_nobody_flies_by(flight):
    settings = PublishedMotion(start_x_m=0.3, start_y_m=-0.2, start_heading_deg=math.degrees(0.5))
    own = flight("reintegration", settings=settings)
    assert pose_of(own.states[0]) == (0.5, 0.0, 0.0, 0.3, -0.2)
    own.take_off()
    expected = stepped(Moving(0.5, 0.0, 0.0, 0.3, -0.2), PUSH[0], PUSH[1:], 0.1)
    state = own.push(1.1)
    assert pose_of(state) == pytest.approx(expected)
    assert state.is_lost
    own.fix(1.05, 0.0, 0.0, 0.0)
    assert not own.push(1.2).is_lost


def test_joint_integrates_the_stored_samples_again_from_each_late_fix(flight):
    own = flight("reintegration")
    own.take_off()
    for number in range(11, 21):
        own.push(0.1 * number)
    own.fix(1.2, 0.10, 0.20, 0.30)
    own.fix(1.7, 0.15, 0.18, 0.35)  # velocity (0.1, -0.04) by the difference over 0.5 s
    expected = Moving(0.35, 0.1, -0.04, 0.15, 0.18)
    for _ in range(3):  # 1.8, 1.9, 2.0
        expected = stepped(expected, PUSH[0], PUSH[1:], 0.1)
    assert pose_of(own.estimator.state()) == pytest.approx(expected)
    assert own.estimator.state().rate_rad_s == pytest.approx(PUSH[0])
    expected = stepped(expected, PUSH[0], PUSH[1:], 0.1)
    assert pose_of(own.push(2.1)) == pytest.approx(expected)  # and plainly on


def test_a_sample_is_cut_at_the_exposure(flight):
    own = flight("reintegration")
    own.take_off()
    own.push(1.1)
    own.push(1.2)
    own.fix(1.04, 0.0, 0.0, 0.0)
    expected = stepped(
        stepped(Moving(0.0, 0.0, 0.0, 0.0, 0.0), PUSH[0], PUSH[1:], 0.06), PUSH[0], PUSH[1:], 0.1
    )
    assert pose_of(own.estimator.state()) == pytest.approx(expected)


def test_zeros_are_the_untrimmed_mean_of_the_whole_rest(flight):
    wild = (ZERO[0], ZERO[1] + 1.0, ZERO[2])
    own = flight("reintegration", last_of_rest=wild)
    own.fix(0.5, 0.0, 0.0, 0.0)  # what it drops of the stored samples is no part of the rest
    own.take_off()
    state = own.push(1.1)
    biases = (state.bias_rate_rad_s, state.bias_ax_m_s2, state.bias_ay_m_s2)
    assert biases == pytest.approx((ZERO[0], ZERO[1] + 0.1, ZERO[2]))
    deaf = flight("reintegration", last_of_rest=wild, settings=PublishedMotion(median_zeros=True))
    deaf.take_off()
    assert deaf.push(1.1).bias_ax_m_s2 == pytest.approx(ZERO[1])


def test_the_whole_of_a_long_rest_counts_though_fixes_came(noise, fix_covariance):
    estimator = PUBLISHED["reintegration"](noise)
    estimator.begin_rest(0)
    for number in range(1, 301):
        reading = (0.1 if number <= 100 else 0.4, 0.0, 0.0)
        estimator.add_imu(ImuPacket(number * NS // 100, 0.01, *reading, 20.0))
        if number % 50 == 0:
            estimator.add_fix(Fix(number * NS // 100, number * NS // 100, 0.0, 0.0, 0.0, fix_covariance))
    estimator.end_rest(3 * NS)
    assert estimator.state().bias_rate_rad_s == pytest.approx((0.1 + 2 * 0.4) / 3.0)


def test_a_sample_beyond_the_limits_pauses_the_integration(flight):
    for settings, steps in (
        (PublishedMotion(), (0.2,)),  # d counts from the last used sample
        (PublishedMotion(fills_gated=True), (0.1, 0.1)),
    ):
        own = flight("reintegration", settings=settings)
        own.fix(0.9, 0.0, 0.0, 0.0)
        own.take_off()
        before = own.push(1.1)
        paused = own.packet(1.2, (0.0, 3.0, 0.0))
        if not settings.fills_gated:
            assert pose_of(paused) == pose_of(before)
        expected = Moving(*pose_of(before))
        for step in steps:
            expected = stepped(expected, PUSH[0], PUSH[1:], step)
        assert pose_of(own.push(1.3)) == pytest.approx(expected)
        assert own.estimator.counters.by_name.get("packet_outside_the_gates", 0) == len(steps) % 2
        own.fix(1.1, before.x_m, before.y_m, before.heading_rad)  # stored samples pass the same gates
        span_s = 1.1 - 0.9
        star = Moving(before.heading_rad, before.x_m / span_s, before.y_m / span_s, before.x_m, before.y_m)
        for step in steps:
            star = stepped(star, PUSH[0], PUSH[1:], step)
        assert pose_of(own.estimator.state()) == pytest.approx(star)


def test_stars_alone_are_late_and_stand_between_fixes(flight):
    own = flight("stars")
    assert own.states[-1] is None
    own.take_off()
    for number in range(11, 18):
        own.push(0.1 * number)
    own.fix(1.1, 0.2, 0.1, 3.1)
    assert pose_of(own.push(1.8)) == (3.1, 0.0, 0.0, 0.2, 0.1)
    own.fix(1.6, 0.3, 0.1, -3.1)
    state = own.push(1.9)
    turned = math.tau - 6.2
    assert pose_of(state) == pytest.approx((3.1 + turned, 0.2, 0.0, 0.3, 0.1))
    assert state.rate_rad_s == pytest.approx(turned / 0.5)
    assert pose_of(own.push(2.0)) == pose_of(state)


def test_the_imu_alone_integrates_from_the_last_fix_of_the_rest(flight):
    own = flight("imu")
    assert own.fix(0.3, 9.0, 9.0, 1.0).used
    assert own.fix(0.6, 0.4, -0.1, 0.2).used
    own.take_off()
    expected = Moving(0.2, 0.0, 0.0, 0.4, -0.1)
    for number in range(11, 15):
        expected = stepped(expected, PUSH[0], PUSH[1:], 0.1)
        assert pose_of(own.push(0.1 * number)) == pytest.approx(expected)
    refused = own.fix(1.2, 5.0, 5.0, 0.0)
    assert (refused.used, refused.reason) == (False, STARTED)
    assert pose_of(own.estimator.state()) == pytest.approx(expected)


def test_the_imu_alone_without_a_fix_at_rest_starts_from_the_first_one_standing(flight):
    own = flight("imu")
    own.take_off()
    assert own.push(1.1) is None
    assert own.fix(1.1, 0.4, -0.1, 0.2).used
    assert pose_of(own.push(1.2)) == pytest.approx(
        stepped(Moving(0.2, 0.0, 0.0, 0.4, -0.1), PUSH[0], PUSH[1:], 0.1)
    )


def test_no_offset_is_fitted_in_the_loop_unless_it_is_asked_for(flight):
    for after_s, change in ((None, 0.0), (2.0, -0.01)):
        own = flight("reintegration", settings=PublishedMotion(fit_after_s=after_s))
        own.take_off()
        own.fix(0.9, 0.0, 0.0, 0.0)
        for number in range(11, 51):  # it stands, and its accelerometer reads 0.01 less
            own.packet(0.1 * number, (ZERO[0], ZERO[1] - 0.01, ZERO[2]))
            if number % 5 == 0:
                own.fix(0.1 * number, 0.0, 0.0, 0.0)
        state = own.estimator.state()
        assert state.bias_ax_m_s2 == pytest.approx(ZERO[1] + change, abs=1e-9)


def test_a_hole_in_the_packets_is_lost_until_a_fix_from_after_it(flight):
    own = flight("reintegration")
    own.fix(0.9, 0.0, 0.0, 0.0)
    own.take_off()
    assert not own.push(1.1).is_lost
    assert own.push(4.0, dt_s=2.9).is_lost
    own.fix(2.0, 0.0, 0.0, 0.0)
    assert own.push(4.1).is_lost
    own.fix(4.05, 0.0, 0.0, 0.0)
    assert not own.push(4.2).is_lost


@pytest.mark.parametrize("words", [{"fit_after_s": 0.0}, {"start_x_m": math.nan}])
def test_settings_that_are_none_are_refused(words):
    with pytest.raises(ValueError, match=next(iter(words))):
        PublishedMotion(**words)
