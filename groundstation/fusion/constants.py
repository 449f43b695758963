"""The constants of a mock-up by their names in calibration files, and a model that starts from them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from groundstation.fusion import error_state as es
from groundstation.fusion.noise import NoiseModel

CONSTANTS: Mapping[str, tuple[int, str]] = {
    "gyro_bias": (es.GYRO_BIAS, "rad/s"),
    "acc_bias_x": (es.ACC_BIAS_X, "m/s^2"),
    "acc_bias_y": (es.ACC_BIAS_Y, "m/s^2"),
    "gyro_scale": (es.GYRO_SCALE, "1"),
    "acc_scale_x": (es.ACC_MATRIX, "1"),
    "acc_cross_xy": (es.ACC_MATRIX + 1, "1"),
    "acc_cross_yx": (es.ACC_MATRIX + 2, "1"),
    "acc_scale_y": (es.ACC_MATRIX + 3, "1"),
    "lever_x": (es.LEVER_X, "m"),
    "lever_y": (es.LEVER_Y, "m"),
    "gyro_temperature_slope": (es.GYRO_TEMPCO, "rad/s/C"),
    "acc_x_temperature_slope": (es.ACC_TEMPCO_X, "m/s^2/C"),
    "acc_y_temperature_slope": (es.ACC_TEMPCO_Y, "m/s^2/C"),
    "slope_x": (es.SLOPE_X, "m/s^2"),
    "slope_y": (es.SLOPE_Y, "m/s^2"),
    "camera_delay": (es.FIX_DELAY, "s"),
}
"""Name: error state and unit. Biases are those at the end of the recording and at its first temperature."""

OF_THE_DAY = frozenset({"gyro_bias", "acc_bias_x", "acc_bias_y", "slope_x", "slope_y"})
"""What no calibration can promise for the next run: it is found anew at rest, or the table's map gives it."""


def noise_with_constants(noise: NoiseModel, found: Mapping[str, tuple[float, float]]) -> NoiseModel:
    """Return the model with what calibrations found, weighed against what it reported itself.

    Args:
        noise: of the rig.
        found: value and sigma by name; those of the day are left out.

    Raises:
        KeyError: a name is none of `CONSTANTS`.
    """
    before, variance = es.initial_state(noise), es.initial_variance(noise)
    calibrated = []
    for name, (value, sigma) in found.items():
        if name in OF_THE_DAY:
            continue
        k, _ = CONSTANTS[name]
        # without a word of the rig (sigma 0) the calibration is all there is
        share = variance[k] / (variance[k] + sigma**2) if variance[k] > 0.0 else 1.0
        mixed = float(before[k] + share * (value - before[k]))
        calibrated.append((k, mixed, float(share) ** 0.5 * sigma))
    lever = {k: value for k, value, _ in calibrated}
    return replace(
        noise,
        calibrated=tuple(calibrated),
        imu_offset_x_m=lever.get(es.LEVER_X, noise.imu_offset_x_m),
        imu_offset_y_m=lever.get(es.LEVER_Y, noise.imu_offset_y_m),
    )
