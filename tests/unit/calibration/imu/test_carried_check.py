"""What is held while constants are tried, and biases carried to another temperature."""

import math
from dataclasses import replace

import pytest

from calibration.imu.carried_check import NO_SIGMA, carried, held, held_before, warmed
from calibration.outcome import CalibrationRefusedError
from calibration.result import Quantity
from groundstation.fusion import error_state as es
from groundstation.fusion.constants import CONSTANTS
from groundstation.parts.fusion.estimation import rig_noise
from groundstation.rig.read import load_rig

FOUND = {name: Quantity(0.01 * (k + 1), 1e-4, unit) for k, (name, (_, unit)) in enumerate(CONSTANTS.items())}


@pytest.fixture(scope="module")
def rig(pytestconfig):
    return load_rig(pytestconfig.rootpath / "examples" / "rigs" / "drawn_fixes.toml")


def test_the_constants_found_are_held_with_their_sigmas(rig):
    noise = held(rig_noise(rig, "alpha"), FOUND)
    state, variance = es.initial_state(noise), es.initial_variance(noise)
    for name, (k, _) in CONSTANTS.items():
        assert state[k] == FOUND[name].value
        assert math.sqrt(variance[k]) == pytest.approx(FOUND[name].sigma)


def test_the_rigs_constants_are_held_as_they_are_but_for_what_is_of_the_day(rig):
    before = replace(rig_noise(rig, "alpha"), calibrated=((es.GYRO_SCALE, 0.003, 0.001),))
    noise = held_before(before, FOUND)
    state, variance = es.initial_state(noise), es.initial_variance(noise)
    assert state[es.GYRO_SCALE] == 0.003
    assert math.sqrt(variance[es.GYRO_SCALE]) == pytest.approx(NO_SIGMA)
    assert state[es.LEVER_X] == before.imu_offset_x_m
    assert state[es.GYRO_BIAS] == FOUND["gyro_bias"].value


def test_a_bias_warms_up_with_its_slope():
    moved = warmed(FOUND, 2.0)
    slope = FOUND["gyro_temperature_slope"]
    assert moved["gyro_bias"].value == pytest.approx(FOUND["gyro_bias"].value + 2.0 * slope.value)
    assert moved["gyro_bias"].sigma > FOUND["gyro_bias"].sigma
    assert moved["gyro_scale"] == FOUND["gyro_scale"]
    assert warmed(FOUND, math.nan) == FOUND


def test_without_fixes_there_is_no_verdict(rig):
    with pytest.raises(CalibrationRefusedError, match="0 fixes come 3 s after the one before, 4 are needed"):
        carried(rig, "alpha", [], rig_noise(rig, "alpha"))
