"""The 23 error states of the filter: what they mean, how they start and how they age.

Behind them stand the slopes at the nodes of the learned surface, of which WAVE_X, WAVE_Y are the local value.

Notation: theta heading, v and p velocity and position of the IMU point in the table frame, w rate, f specific
force at the IMU point in body axes, R(theta) = table_from_body. Between packets

    w = (omega - b_g - k_g dT)(1 - s_g)        f = (I - M)(a - b_a - k_a dT)
    theta' = w        v' = R(theta) f + slope + wave        p' = v

Slope and wave are added because an accelerometer does not feel the slope it glides down. Tracking the IMU
point instead of the centre of mass keeps the gyro from being differentiated.
The error of an estimate is true minus nominal, additive in every component.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from groundstation.fusion.noise import NoiseModel

Array = NDArray[np.float64]

THETA = 0
VX, VY = 1, 2
PX, PY = 3, 4
GYRO_BIAS = 5
ACC_BIAS_X, ACC_BIAS_Y = 6, 7
SLOPE_X, SLOPE_Y = 8, 9
GYRO_SCALE = 10
LEVER_X, LEVER_Y = 11, 12
WAVE_X, WAVE_Y = 13, 14
ACC_MATRIX = 15  # xx, xy, yx, yy of M
GYRO_TEMPCO = 19
ACC_TEMPCO_X, ACC_TEMPCO_Y = 20, 21
FIX_DELAY = 22
"""How much later than stamped an exposure was, s."""
SIZE = 23
MOVING = 5
"""The first five states move with the packets; the others are constants or slow walks."""


def initial_state(noise: NoiseModel) -> Array:
    """Return the nominal state (23,) before any measurement."""
    x = np.zeros(SIZE)
    x[LEVER_X] = noise.imu_offset_x_m
    x[LEVER_Y] = noise.imu_offset_y_m
    x[GYRO_TEMPCO] = noise.gyro_tempco_rad_s_c
    x[ACC_TEMPCO_X] = x[ACC_TEMPCO_Y] = noise.acc_tempco_m_s2_c
    for k, value, _ in noise.calibrated:
        x[k] = value
    return x


def initial_variance(noise: NoiseModel) -> Array:
    """Return the variances (23,) before any measurement; pose and velocity are zero, a fix sets them."""
    sigma = np.zeros(SIZE)
    sigma[GYRO_BIAS] = noise.gyro_bias_sigma_rad_s
    sigma[ACC_BIAS_X : ACC_BIAS_Y + 1] = noise.acc_bias_sigma_m_s2
    sigma[SLOPE_X : SLOPE_Y + 1] = noise.slope_sigma_m_s2
    sigma[GYRO_SCALE] = noise.gyro_scale_sigma
    sigma[LEVER_X : LEVER_Y + 1] = noise.imu_offset_sigma_m
    sigma[WAVE_X : WAVE_Y + 1] = noise.waviness_sigma_m_s2
    sigma[ACC_MATRIX : ACC_MATRIX + 4] = noise.acc_scale_sigma
    sigma[GYRO_TEMPCO] = noise.tempco_sigma_ratio * abs(noise.gyro_tempco_rad_s_c)
    sigma[ACC_TEMPCO_X : ACC_TEMPCO_Y + 1] = noise.tempco_sigma_ratio * abs(noise.acc_tempco_m_s2_c)
    sigma[FIX_DELAY] = noise.fix_delay_sigma_s
    for k, _, left in noise.calibrated:
        sigma[k] = left
    return sigma**2


def move(P: Array, F: Array, Q: Array) -> None:
    """Carry the covariance P (N, N) over a segment in place, given its five moving rows F (5, 23)."""
    rows = F @ P[:SIZE]
    corner = rows[:, :SIZE] @ F.T + Q
    P[:MOVING] = rows
    P[:, :MOVING] = rows.T
    P[:MOVING, :MOVING] = 0.5 * (corner + corner.T)


def reopened_variance() -> Array:
    """Return upper limits (23,) of the variances with which a filter that lost itself begins again."""
    sigma = np.full(SIZE, np.inf)
    sigma[GYRO_BIAS] = 0.02
    sigma[ACC_BIAS_X : ACC_BIAS_Y + 1] = 0.02
    return sigma**2


def age(P: Array, duration_s: float, noise: NoiseModel) -> None:
    """Let the biases walk, in place."""
    P[GYRO_BIAS, GYRO_BIAS] += noise.gyro_bias_walk_rad_s_rts**2 * duration_s
    walked = noise.acc_bias_walk_m_s2_rts**2 * duration_s
    P[ACC_BIAS_X, ACC_BIAS_X] += walked
    P[ACC_BIAS_Y, ACC_BIAS_Y] += walked
