"""Shifted zeros and bursts of wrong fixes: by hand, by seeds, and no alarm without them."""

import math

import numpy as np
import pytest

from groundstation.supervision.imu_consistency import ImuConsistency, ImuConsistencyConfig

CONFIG = ImuConsistencyConfig(gyro_density_rad_s_rthz=6.7e-5, heading_sigma_rad=2e-4)
NOISY = ImuConsistencyConfig(gyro_density_rad_s_rthz=1.75e-3, heading_sigma_rad=2e-4)
NAN = (math.nan,) * 3


def turn(checks, rng, seconds, *, step_rad_s=0.0, from_s=5.0, fix_hz=15.0, config=CONFIG, wrong=0.0):
    """A vehicle that turns to and fro, its gyro and its fixes; when the first finding came, in s."""
    window_s, heading, next_fix = 0.01, 3.0, 0.0
    samples = round(seconds / window_s)
    noise = config.gyro_density_rad_s_rthz / math.sqrt(window_s) * rng.standard_normal(samples)
    for count in range(samples):
        now = (count + 1) * window_s
        rate = 0.4 * math.sin(0.7 * now)
        heading += rate * window_s
        zero = step_rad_s if now >= from_s else 0.0
        checks.sample(round(now * 1e9), rate + noise[count] + zero)
        if now >= next_fix:
            next_fix += 1.0 / fix_hz
            seen = heading + rng.normal(0.0, config.heading_sigma_rad) + rate * rng.normal(0.0, 5e-4)
            if rng.random() < wrong:
                seen += rng.uniform(-math.pi, math.pi)
            seen = (seen + math.pi) % (2.0 * math.pi) - math.pi
            checks.fix("stars", round(now * 1e9), seen)
        if checks.findings:
            return now
    return math.inf


def test_two_fixes_add_what_the_formula_says():
    checks = ImuConsistency(ImuConsistencyConfig(
        gyro_density_rad_s_rthz=1e-4, heading_sigma_rad=2e-3, zero_sigma_rad_s=0.0, scale_sigma=0.0,
        stamp_sigma_s=0.0, zero_step_rad_s=0.01,
    ))  # fmt: skip
    for count in range(11):
        checks.sample(count * 50_000_000, 0.2)
    checks.fix("stars", 0, 1.0)
    checks.fix("stars", 500_000_000, 1.0 + 0.1 + 0.004)  # 0.1 rad by the gyro, 4 mrad more by the fixes
    variance = 2 * 4e-6 + 0.5e-8  # of both fixes, and of the gyro in between
    left, right = checks._headings["stars"].leans
    assert left.evidence == pytest.approx((0.004 * 0.005 - 0.5 * 0.005**2) / variance)
    # half of the second fix is believed, so that much of the step is still to be seen
    assert left.offset_rad == pytest.approx(0.005 * 4e-6 / variance)
    assert right.evidence == 0.0


@pytest.mark.parametrize(("config", "step_rad_s"), [(CONFIG, 0.0087), (NOISY, 0.0262)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_gyro_whose_zero_jumps_is_found_within_a_second(config, step_rad_s, sign):
    # 0.5 deg/s; 1.5 deg/s where the gyro alone drifts by 0.1 deg in a second
    delays = [
        turn(
            ImuConsistency(config),
            np.random.default_rng(seed),
            8.0,
            step_rad_s=sign * step_rad_s,
            config=config,
        )
        for seed in range(20)
    ]
    assert all(delay >= 5.0 for delay in delays)
    assert np.percentile(delays, 95) - 5.0 < 1.0


@pytest.mark.parametrize("config", [CONFIG, NOISY])
def test_a_healthy_gyro_with_one_wrong_fix_in_ten_is_not_accused(config):
    for seed in range(4):
        checks = ImuConsistency(config)
        assert turn(checks, np.random.default_rng(seed), 120.0, config=config, wrong=0.1) == math.inf


def test_slow_fixes_find_it_too_in_a_few_fixes():
    delay = turn(ImuConsistency(CONFIG), np.random.default_rng(3), 12.0, step_rad_s=0.0087, fix_hz=1.5)
    assert 5.0 < delay < 5.0 + 4.0


def test_over_a_gap_in_the_samples_nothing_is_concluded():
    checks = ImuConsistency(CONFIG)
    for count in range(11):
        checks.sample(count * 10_000_000, 0.0)
    checks.fix("stars", 50_000_000, 0.0)
    for count in range(40, 51):
        checks.sample(count * 10_000_000, 0.0)
    for _ in range(5):
        checks.fix("stars", 450_000_000, 2.0)  # it turned unseen
    assert all(lean.evidence == 0.0 for lean in checks._headings["stars"].leans)


def account(checks, used, *, nis=3.0, reason="used", innovation=(1e-4, -1e-4, 1e-4)):
    checks.account("stars", used=used, reason=reason, innovation=innovation, nis=nis)


def test_a_burst_of_refused_fixes_is_named_before_fifteen_of_them():
    checks = ImuConsistency(CONFIG)
    for _ in range(100):
        account(checks, used=True)
    rng, count = np.random.default_rng(1), 0
    while not checks.findings:
        count += 1
        innovation = tuple(rng.normal(0.0, 0.3, 3))
        account(checks, used=False, reason="outside the gate", nis=900.0, innovation=innovation)
    assert count == math.ceil(checks.threshold / math.log(0.6 / 0.05)) < 15
    [finding] = checks.findings
    assert finding.id == "wrong_fixes"
    assert "8 fixes in a row refused" in finding.detail


def test_wrong_fixes_now_and_then_are_no_burst():
    rng, checks = np.random.default_rng(2), ImuConsistency(CONFIG)
    for _ in range(50_000):
        is_wrong = rng.random() < 0.1
        if is_wrong:
            account(checks, used=False, reason="outside the gate", nis=900.0, innovation=(0.2, 0.1, 0.0))
        else:
            account(checks, used=True, nis=float(rng.chisquare(3)))
    assert checks.findings == ()


def test_innovations_of_three_times_their_covariance_are_found_and_of_one_time_not():
    rng, checks = np.random.default_rng(3), ImuConsistency(CONFIG)
    for _ in range(50_000):
        account(checks, used=True, nis=float(1.2 * rng.chisquare(3)))
    assert checks.findings == ()
    count = 0
    while not checks.findings:
        count += 1
        account(checks, used=True, nis=min(25.0, float(3.0 * rng.chisquare(3))))
    assert count < 120
    assert checks.findings[0].id == "filter_inconsistent"
    assert "covariance" in checks.findings[0].detail


def test_fixes_that_all_lie_to_one_side_leave_open_who_is_wrong():
    checks = ImuConsistency(CONFIG)
    for _ in range(12):
        account(checks, used=False, reason="outside the gate", nis=99.0, innovation=(0.3, 0.1, 0.0))
    assert "to one side" in checks.findings[0].detail
    assert "316 mm" in checks.findings[0].detail


def test_a_filter_that_expects_too_little_and_begins_again_accuses_nobody():
    rng, checks = np.random.default_rng(3), ImuConsistency(CONFIG)
    while not checks.findings:
        account(checks, used=True, nis=min(25.0, float(3.0 * rng.chisquare(3))))
    account(checks, used=True, reason="starts the estimate again", nis=40.0)
    assert [finding.id for finding in checks.findings] == ["filter_inconsistent"]
    for _ in range(12):
        account(checks, used=False, reason="outside the gate", nis=99.0, innovation=(0.3, 0.1, 0.0))
    assert "wrong_fixes" in {finding.id for finding in checks.findings}, "a burst is one all the same"


def test_an_estimate_that_begins_again_is_a_finding_at_once():
    checks = ImuConsistency(CONFIG)
    account(checks, used=True, reason="starts the estimate again", nis=400.0)
    assert checks.findings[0].id == "wrong_fixes"
    checks.reset()
    assert checks.findings == ()


def test_other_refusals_say_nothing():
    checks = ImuConsistency(CONFIG)
    for _ in range(100):
        account(checks, used=False, reason="before the first packet", nis=math.nan, innovation=NAN)
    assert checks.findings == ()


def test_estimated_zeros_that_walk_are_usual_and_that_run_are_not():
    rng, checks = np.random.default_rng(4), ImuConsistency(CONFIG)
    gyro = 0.01
    for count in range(5 * 3600):
        gyro += rng.normal(0.0, 1.2e-5)
        checks.zero(count * 200_000_000, gyro)
    assert checks.findings == ()
    checks.zero(5 * 3600 * 200_000_000, gyro + 0.006)
    assert checks.findings[0].id == "imu_shifted"
    assert "deg/s" in checks.findings[0].detail


@pytest.mark.parametrize(("rate_rad_s", "is_found"), [(0.0, True), (0.59, True), (0.61, False)])
def test_in_a_spin_and_for_a_while_after_scale_and_zero_are_not_told_apart(rate_rad_s, is_found):
    checks = ImuConsistency(ImuConsistencyConfig(gyro_density_rad_s_rthz=6.7e-5, heading_sigma_rad=1e-3))
    for step in range(100):
        now_ns = step * 100_000_000
        checks.sample(now_ns, rate_rad_s if step < 20 else 0.0)
        checks.zero(now_ns, 7e-3 * min(1.0, step / 30))
    assert bool(checks.findings) is is_found


def test_a_shift_long_after_a_spin_is_found():
    checks = ImuConsistency(ImuConsistencyConfig(gyro_density_rad_s_rthz=6.7e-5, heading_sigma_rad=1e-3))
    checks.sample(0, 1.0)
    for step in range(300):
        checks.zero(step * 100_000_000, 0.0 if step < 260 else 7e-3)
    assert checks.findings
