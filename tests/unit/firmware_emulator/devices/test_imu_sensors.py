import math

import numpy as np
import pytest

from firmware_emulator.devices.imu_sensors import (
    GYRO_COUNTS_PER_RAD_S,
    TILT_COUNTS_PER_M_S2,
    Disturbances,
    FirstOrder,
    ImuSensors,
)
from firmware_emulator.devices.sensor_errors import NoiseFigures, SensorErrors, noise_figures

DEG_S = math.radians(1.0)
SILENT = NoiseFigures(0.0, 0.0, 0.0, 0.0)
STILL = [(0.0, 0.0, 0.0)] * 100


def sensors(noise=SILENT, errors=None, seed=1, **options):
    return ImuSensors(
        errors or SensorErrors(), noise, np.random.default_rng(seed), longest_window=400, **options
    )


def still_codes(model, windows=400, seed=1):
    block = sensors(noise_figures(model), seed=seed)
    return np.concatenate([block.codes(STILL, 25.0) for _ in range(windows)], axis=1)


def test_gyro_noise_is_that_of_the_data_sheet_behind_its_40_hz_filter():
    """0.1 deg/s/sqrt(Hz) x sqrt(40 Hz x pi/2) = 0.79 deg/s rms."""
    rate = (still_codes("datasheet")[0] - 2048.0) / GYRO_COUNTS_PER_RAD_S
    assert np.std(rate) == pytest.approx(0.793 * DEG_S, rel=0.03)


def test_averaging_eight_polls_helps_by_a_quarter_only():
    """The filter correlates neighbouring polls: 0.79 to 0.60 deg/s, not to 0.79 / sqrt(8)."""
    rate = (still_codes("datasheet", windows=800)[0] - 2048.0) / GYRO_COUNTS_PER_RAD_S
    averaged = rate.reshape(-1, 8).mean(axis=1)
    assert np.std(averaged) / np.std(rate) == pytest.approx(0.75, abs=0.02)


def test_published_noise_is_white():
    turning = np.linspace(0.0, 20.0, 400) / GYRO_COUNTS_PER_RAD_S  # over many codes: rounding is unbiased
    block = sensors(noise_figures("published"))
    codes = np.concatenate(
        [block.codes([(rate, 0.0, 0.0) for rate in turning], 25.0) for _ in range(100)], axis=1
    )
    rate = (codes[0] - 2048.0) / GYRO_COUNTS_PER_RAD_S - np.tile(turning, 100)
    quantised = math.hypot(0.1 * DEG_S, 1.0 / GYRO_COUNTS_PER_RAD_S / math.sqrt(12.0))
    assert np.std(rate) == pytest.approx(quantised, rel=0.05)
    assert np.std(rate.reshape(-1, 8).mean(axis=1)) == pytest.approx(np.std(rate) / math.sqrt(8.0), rel=0.05)
    force = (codes[1] - codes[2]) / (2.0 * TILT_COUNTS_PER_M_S2)
    assert np.std(force) == pytest.approx(0.002, rel=0.1)


def test_inclinometer_noise_is_below_its_code_step():
    difference = np.subtract(*still_codes("datasheet")[1:3])
    assert 0.0 < np.std(difference) < 0.75


def test_channels_are_quantised_before_they_are_subtracted_and_averaged():
    """0.3 counts on X and -0.3 on Y vanish; rounding X - Y would have made 1 of 0.6."""
    force = 0.3 / TILT_COUNTS_PER_M_S2
    assert sensors().average([(0.0, force, 0.0)] * 10, 25.0)[1][:2] == (1024.0, 1024.0)
    force = 0.6 / TILT_COUNTS_PER_M_S2
    assert sensors().average([(0.0, force, 0.0)] * 10, 25.0)[1][:2] == (1025.0, 1023.0)


def test_averages_are_finer_than_a_code():
    ramp = np.linspace(0.0, 2.0, 400) / GYRO_COUNTS_PER_RAD_S
    gyro, _ = sensors().average([(rate, 0.0, 0.0) for rate in ramp], 25.0)
    assert gyro == pytest.approx(2049.0, abs=0.05)


@pytest.mark.parametrize(
    ("felt", "codes"),
    [
        ((10 * DEG_S, 0.0, 0.0), (2089.0, 1024.0, 1024.0, 1024.0, 1024.0)),
        ((-10 * DEG_S, 0.0, 0.0), (2007.0, 1024.0, 1024.0, 1024.0, 1024.0)),
        ((0.0, 9.80665 * 0.1, 0.0), (2048.0, 1352.0, 696.0, 1024.0, 1024.0)),
        ((0.0, 0.0, -9.80665 * 0.1), (2048.0, 1024.0, 1024.0, 696.0, 1352.0)),
        ((600 * DEG_S, 9.80665, 0.0), (4095.0, 2047.0, 0.0, 1024.0, 1024.0)),
    ],
)
def test_codes_follow_the_documented_scales_and_signs(felt, codes):
    gyro, tilts = sensors().average([felt] * 4, 25.0)
    assert (gyro, *tilts) == codes


def test_temperature_moves_nulls_and_scale():
    errors = SensorErrors(gyro_tempco_rad_s_k=0.5 * DEG_S, acc_tempco_m_s2_k=(0.03, 0.0))
    gyro, tilts = sensors(errors=errors).average(STILL, 35.0)
    assert gyro == round(2048 + 5.0 * DEG_S * GYRO_COUNTS_PER_RAD_S)
    assert tilts[0] == round(1024 + 0.3 * TILT_COUNTS_PER_M_S2)


def test_a_low_pass_reaches_63_percent_after_its_time_constant():
    step = FirstOrder(40.0, 10)
    step(np.zeros((1, 1)))
    rows = np.concatenate([step(np.ones((1, 4))) for _ in range(10)], axis=1)[0]
    time_constant_polls = 1000.0 / (2.0 * math.pi * 40.0)
    expected = 1.0 - np.exp(-np.arange(1, 41) / time_constant_polls)
    np.testing.assert_allclose(rows, expected, rtol=1e-12)


def test_the_low_pass_does_not_care_how_polls_are_cut():
    rng = np.random.default_rng(0)
    rows = rng.standard_normal((2, 60))
    whole, parts = FirstOrder(18.0, 60), FirstOrder(18.0, 60)
    pieces = [parts(rows[:, start:end]) for start, end in ((0, 1), (1, 8), (8, 37), (37, 60))]
    np.testing.assert_allclose(np.concatenate(pieces, axis=1), whole(rows), atol=1e-12)


def test_codes_do_not_depend_on_how_polls_are_cut():
    whole, parts = sensors(noise_figures("published")), sensors(noise_figures("published"))
    felt = [(0.01 * poll, 0.1, -0.02 * poll) for poll in range(6)]
    pieces = [parts.codes(felt[start:end], 25.0) for start, end in ((0, 1), (1, 3), (3, 6))]
    np.testing.assert_array_equal(np.concatenate(pieces, axis=1), whole.codes(felt, 25.0))


def test_outliers_come_at_their_rate():
    block = sensors(outlier_rate_hz=2.0)
    wild = sum(
        int((block.codes(STILL, 25.0) != [[2048.0]] + [[1024.0]] * 4).any(axis=0).sum()) for _ in range(1000)
    )
    assert wild == pytest.approx(200, rel=0.25)


def test_a_stuck_gyro_and_a_forced_channel_say_what_they_must():
    disturbed = Disturbances(gyro_stuck_code=2100.0, forced_tilts={2: 2047.0})
    gyro, tilts = sensors(noise_figures("published")).average(STILL, 25.0, disturbed)
    assert gyro == 2100.0
    assert tilts[2] == 2047.0
