"""How far gyro and inclinometers are from perfect: noise, biases, scales, temperature."""

import math
from dataclasses import dataclass, replace
from typing import Literal

from firmware_emulator.plant.air_table import GRAVITY_M_S2


@dataclass(frozen=True, slots=True)
class NoiseFigures:
    """Noise at the sensor's output before quantisation, and its low-pass (0 Hz: none).

    `gyro_rms_rad_s` and `acc_rms_m_s2` (of a tilt difference) are standard deviations of one poll.
    """

    gyro_rms_rad_s: float
    acc_rms_m_s2: float
    gyro_bandwidth_hz: float
    acc_bandwidth_hz: float


_GYRO_DENSITY_RAD_S = math.radians(0.1)  # per sqrt(Hz), ADXRS300 data sheet
_GYRO_BANDWIDTH_HZ = 40.0  # 180 kOhm x 22 nF
_TILT_DENSITY_RAD = math.radians(0.0004)  # per sqrt(Hz), SCA103T data sheet
_TILT_BANDWIDTH_HZ = 18.0


def noise_figures(
    model: Literal["published", "datasheet"],
    gyro_rms_rad_s: float | None = None,
    acc_rms_m_s2: float | None = None,
) -> NoiseFigures:
    """Figures of the published experiment (white polls), or of the data sheets (filtered noise).

    What is stated takes the place of the model's own deviation.
    """
    figures = _PUBLISHED if model == "published" else _DATASHEET
    if gyro_rms_rad_s is not None:
        figures = replace(figures, gyro_rms_rad_s=gyro_rms_rad_s)
    if acc_rms_m_s2 is not None:
        figures = replace(figures, acc_rms_m_s2=acc_rms_m_s2)
    return figures


_PUBLISHED = NoiseFigures(0.0017453292519943296, 0.002, 0.0, 0.0)
_DATASHEET = NoiseFigures(  # noise bandwidth of a first-order filter
    _GYRO_DENSITY_RAD_S * math.sqrt(_GYRO_BANDWIDTH_HZ * math.pi / 2.0),
    _TILT_DENSITY_RAD * GRAVITY_M_S2 * math.sqrt(_TILT_BANDWIDTH_HZ * math.pi / 2.0),
    _GYRO_BANDWIDTH_HZ,
    _TILT_BANDWIDTH_HZ,
)


@dataclass(frozen=True, slots=True)
class SensorErrors:
    """How this very block differs from the nominal one, at 25 deg C and per kelvin."""

    gyro_bias_rad_s: float = 0.0
    gyro_tempco_rad_s_k: float = 0.0
    gyro_scale: float = 1.0
    gyro_scale_tempco_per_k: float = 0.0
    gyro_walk_rad_s_sqrt_s: float = 0.0
    acc_bias_m_s2: tuple[float, float] = (0.0, 0.0)
    acc_tempco_m_s2_k: tuple[float, float] = (0.0, 0.0)
    acc_scale: tuple[float, float] = (1.0, 1.0)
    acc_cross: tuple[float, float] = (0.0, 0.0)
    """Share of the other axis' specific force."""
    imbalance_counts: tuple[float, float] = (0.0, 0.0)
    """Common mode of each chip: X + Y - 2048."""


class WarmUp:
    """Temperature of the block: one state that rises to its own heat above the room's."""

    def __init__(self, ambient_c: float, rise_k: float, time_constant_s: float) -> None:
        self._ambient_c, self._rise_k, self._tau_s = ambient_c, rise_k, time_constant_s

    def at(self, seconds_on: float) -> float:
        """Temperature in deg C, so long after power-up."""
        return self._ambient_c - self._rise_k * math.expm1(-seconds_on / self._tau_s)
