"""Means of the gyro's readings without what its converter did to them. Pure."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.laboratory.rounding import noise_of_poll, rounded
from drivers.imu_block.sensors import GYRO_SCALE_RAD_S

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class RateReading:
    """Rates without what rounding did to them.

    Attributes:
        rate_rad_s: (n,).
        noise_rad_s: Of one poll before rounding; NaN where it is not known.
        noise_sigma_rad_s: Of it.
    """

    rate_rad_s: Array
    noise_rad_s: float
    noise_sigma_rad_s: float


def read_rates(rate_rad_s: Array, fitted_rad_s: Array, scatter_rad_s: float, polls: int) -> RateReading:
    """Undo what the gyro's converter does to means of polls.

    Args:
        rate_rad_s: (n,) as read.
        fitted_rad_s: (n,) near the rates that were.
        scatter_rad_s: Of the means, about what is expected of them.
        polls: In a mean.
    """
    fitted = fitted_rad_s / GYRO_SCALE_RAD_S
    variance = (scatter_rad_s / GYRO_SCALE_RAD_S) ** 2
    noise, slope = noise_of_poll(fitted, variance, polls)
    if not math.isfinite(noise):
        return RateReading(rate_rad_s, math.nan, math.nan)
    found = rounded(fitted, noise)
    return RateReading(
        rate_rad_s - GYRO_SCALE_RAD_S * found.bias,
        GYRO_SCALE_RAD_S * noise,
        GYRO_SCALE_RAD_S * slope * variance * math.sqrt(2.0 / len(rate_rad_s)),
    )
