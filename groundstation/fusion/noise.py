"""What a fusion estimator must be given about the sensors, the table and their errors."""

from __future__ import annotations

import math
from dataclasses import dataclass

GYRO_BIAS_WALK_RAD_S_RTS = 1.2e-5
"""Of a warm sensor."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NoiseModel:
    """Error model of one mock-up's IMU and star tracker; every figure comes from rig or calibration.

    White noise is given as a density, so that the rate of the packets does not matter. Sigmas are one
    standard deviation of what calibration has left over, at the start of a run.
    """

    packet_period_s: float
    """Averaging window of one IMU packet."""
    gyro_density_rad_s_rthz: float
    """White rate noise, averaged over packets (angle random walk in rad/sqrt(s))."""
    acc_density_m_s2_rthz: float
    """White acceleration noise (velocity random walk in m/s/sqrt(s))."""
    star_sigma_xy_m: float
    star_sigma_heading_rad: float

    fix_time_sigma_s: float = 0.0
    """Of an exposure's stamp against the packets', unless the fix's covariance holds it already."""

    fix_delay_sigma_s: float = 0.0
    """Of the constant part of it: how well the camera's delay was calibrated; 0 leaves it alone."""

    imu_offset_x_m: float = 0.0
    """Accelerometers from the centre of mass, body frame."""
    imu_offset_y_m: float = 0.0
    imu_offset_sigma_m: float = 1e-3

    gyro_bias_sigma_rad_s: float = 0.9
    """Before a rest: the null of the data sheet, +-50 deg/s."""
    acc_bias_sigma_m_s2: float = 0.15
    gyro_bias_walk_rad_s_rts: float = GYRO_BIAS_WALK_RAD_S_RTS
    acc_bias_walk_m_s2_rts: float = 1.6e-5
    gyro_tempco_rad_s_c: float = 0.0
    """Slope of the gyro's null with temperature; a data sheet value is right to `tempco_sigma_ratio`."""
    acc_tempco_m_s2_c: float = 0.0
    tempco_sigma_ratio: float = 0.5
    gyro_scale_sigma: float = 2e-3
    acc_scale_sigma: float = 1e-2
    """Of the accelerometers' scale and of the angles between their axes and the body's."""

    calibrated: tuple[tuple[int, float, float], ...] = ()
    """Constants that calibration files give: error state, value, sigma; in the place of what stands above."""

    unseen_force_m_s2_rthz: float = 6e-3
    """Density of the forces while an accelerometer is not believed: pulses of 20 mm/s^2 over 0.1 s."""

    slope_sigma_m_s2: float = 3e-3
    """Mean tilt of the table as gravity along it (9.8 mm/s^2 per mrad)."""
    waviness_sigma_m_s2: float = 2.2e-4
    """Local departure from the mean slope, per axis."""
    waviness_length_m: float = 0.2
    """Of the height's Gaussian correlation: waves of half a metre to a metre."""
    valve_knock_m_s: float = 3.5e-5
    """What accelerometers read, as a change of velocity, when a valve switches and nothing moves by it."""

    gyro_lag_s: float = 0.0
    """Time constant of the gyro's low-pass, 1 / (2 pi f)."""
    acc_lag_s: float = 0.0
    full_scale_rad_s: float = 8.7
    """Beyond is not a reading; ADIS16100: its converter ends at 499 deg/s."""
    full_scale_m_s2: float = 3.1
    """Beyond is not a reading; SCA103T-D04: its converter ends at 18.2 deg."""
    max_acc_step_m_s2: float = 0.09
    """Largest change of the motion between packets, twice the valves'; the white noise is added to it."""
    max_rate_step_rad_s: float = math.radians(2.0)
    gate_nis: float = 25.0
    """Fixes whose normalised innovation squared (3 degrees of freedom) is above are refused."""
    reopen_after: int = 4
    """Refused fixes in a row that agree with each other prove the filter, not the fixes, wrong."""

    def __post_init__(self) -> None:
        for name in (
            "packet_period_s", "gyro_density_rad_s_rthz", "acc_density_m_s2_rthz",
            "star_sigma_xy_m", "star_sigma_heading_rad", "waviness_length_m",
        ):  # fmt: skip
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                msg = f"{name} must be a positive number, got {value!r}"
                raise ValueError(msg)


def packet_density(poll_sigma: float, lsb: float, poll_rate_hz: float) -> float:
    """Return the white noise density of means of quantised polls.

    Args:
        poll_sigma: one sigma of one poll before quantisation.
        lsb: quantisation step, in the same unit; its error is taken as uniform.
        poll_rate_hz: polls per second, all of them averaged into packets.
    """
    return math.sqrt((poll_sigma**2 + lsb**2 / 12.0) / poll_rate_hz)


STEADY_S = 10.0
"""For about so long a vehicle turns at one rate to within a step of its gyro."""


def rounding_walk(poll_sigma: float, lsb: float) -> float:
    """Return the random walk that stands for what rounding does to means of polls, in the unit over sqrt(s).

    Noise well above a step makes the mean of rounded polls true; below, the mean is off by up to
    lsb / pi exp(-2 (pi sigma / lsb)^2), depending on where between two steps the rate lies (Widrow and
    Kollar, Quantization Noise, 2008: the first harmonic). A rest teaches the null with that error, and each
    other rate has another one.

    Args:
        poll_sigma: one sigma of one poll before quantisation.
        lsb: quantisation step, in the same unit; 0 for none.
    """
    if lsb <= 0.0:
        return 0.0
    return lsb / math.pi * math.exp(-2.0 * (math.pi * poll_sigma / lsb) ** 2) / math.sqrt(STEADY_S)


def lag_of_bandwidth(bandwidth_hz: float) -> float:
    """Return the time constant in s of a first-order low-pass; 0 Hz stands for none."""
    return 0.0 if bandwidth_hz <= 0.0 else 1.0 / (2.0 * math.pi * bandwidth_hz)
