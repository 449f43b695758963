"""Delay of the camera against the IMU: where integrated turn rate and star headings agree best.

A heading that arrived at ``t`` was true at ``t - delay``. With G the integral of the gyro's rate the
model is ``heading = G(t - delay) + offset + bias t``; delay, offset and gyro bias are least squares.
Its spread comes from the residuals: the turn has to change for the delay to be seen at all.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_CLIP_SIGMAS = 4.0
_STEPS = 20
_MIN_HEADINGS = 10


@dataclass(frozen=True, slots=True, eq=False)
class CameraDelay:
    """The delay with its spread.

    Attributes:
        delay_s: Arrival minus exposure.
        std_s: One sigma.
        gyro_bias_rad_s: To subtract from the gyro's rate.
        residual_rad: Heading minus model, of the used fixes.
        used: Which headings were not clipped.
    """

    delay_s: float
    std_s: float
    gyro_bias_rad_s: float
    residual_rad: Array
    used: NDArray[np.bool_]


def camera_delay(
    gyro_t_s: Array, rate_rad_s: Array, arrival_t_s: Array, heading_rad: Array, guess_s: float = 0.0
) -> CameraDelay:
    """Estimate the delay.

    Args:
        gyro_t_s: Times of the rate samples, rising, shape (n,).
        rate_rad_s: Turn rates, shape (n,).
        arrival_t_s: When each heading arrived, shape (m,).
        heading_rad: Headings of the stars, any turn, shape (m,).
        guess_s: First guess of the delay.

    Raises:
        ValueError: The times do not rise, too few headings lie inside the gyro's, or the turn rate
            changes too little to see a delay.
    """
    if len(gyro_t_s) < 2 or (np.diff(gyro_t_s) <= 0.0).any():
        raise ValueError("the gyro's times must rise")
    # A sample is the mean over the window that ends at its time: the angle there is the sum.
    angle = np.concatenate(([0.0], np.cumsum(rate_rad_s[1:] * np.diff(gyro_t_s))))
    delay, middle = guess_s, float(gyro_t_s.mean())
    inside = (arrival_t_s - guess_s > gyro_t_s[0] + 1.0) & (arrival_t_s - guess_s < gyro_t_s[-1] - 1.0)
    if int(inside.sum()) < _MIN_HEADINGS:
        raise ValueError(f"{int(inside.sum())} headings lie inside the gyro's times, 10 are needed")
    times, heading = arrival_t_s[inside], heading_rad[inside]
    offset = bias = 0.0
    used = np.ones(len(times), dtype=bool)
    residual = np.zeros(len(times))
    normal = np.eye(3)
    for step in range(_STEPS):
        model = np.interp(times - delay, gyro_t_s, angle) + offset + bias * (times - middle)
        residual = np.angle(np.exp(1j * (heading - model)))
        if step == 0:  # the offset may be anything: turn the residuals to their common direction
            offset = float(np.angle(np.exp(1j * residual).sum()))
            continue
        rate = np.interp(times - delay, gyro_t_s, rate_rad_s)
        design = np.stack((-rate, np.ones_like(rate), times - middle), axis=1)
        spread = 1.4826 * float(np.median(np.abs(residual - np.median(residual))))
        used = np.abs(residual) <= max(_CLIP_SIGMAS * spread, 1e-9)
        normal = design[used].T @ design[used]
        if np.linalg.cond(normal) > 1e12:
            raise ValueError("the turn rate changes too little to see a delay")
        change = np.linalg.solve(normal, design[used].T @ residual[used])
        delay, offset, bias = delay + change[0], offset + change[1], bias + change[2]
        if abs(change[0]) < 1e-7:
            break
    freedom = max(int(used.sum()) - 3, 1)
    variance = float((residual[used] ** 2).sum()) / freedom
    std = float(np.sqrt(variance * np.linalg.inv(normal)[0, 0]))
    whole = np.zeros(len(arrival_t_s), dtype=bool)
    whole[np.flatnonzero(inside)[used]] = True
    return CameraDelay(float(delay), std, -float(bias), residual[used], whole)
