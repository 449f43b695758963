"""ADIS16100 gyro and two SCA103T-D04 inclinometers: what is felt to averaged codes.

In the order of the real thing: errors and temperature act on the signal, noise joins it, the sensor's
low-pass filters both, each channel is quantised on its own, and only then polls are averaged.

Codes (data sheets): gyro 2048 + 4.1 per deg/s counter-clockwise, 12 bits. Each inclinometer has two opposed
channels of 11 bits, X = 1024 + 3277 per g and Y = 1024 - 3277 per g, where g counts specific force along
the chip's axis. Not modelled, being below the codes' steps: g sensitivity of the gyro (0.001 deg/s at
0.04 m/s^2), the at most 150 us that an inclinometer's register is old (15 um/s of velocity at 0.1 m/s^3).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from firmware_emulator.devices.sensor_errors import NoiseFigures, SensorErrors
from firmware_emulator.plant.air_table import GRAVITY_M_S2
from firmware_emulator.plant.motion_state import Felt

GYRO_NULL, GYRO_TOP = 2048.0, 4095.0
GYRO_COUNTS_PER_RAD_S = 4.1 * 180.0 / math.pi  # ADIS16100: 0.2439 deg/s per LSB
TILT_NULL, TILT_TOP = 1024.0, 2047.0
TILT_COUNTS_PER_M_S2 = 3277.0 / GRAVITY_M_S2  # per channel: 6554 counts/g for X - Y
REFERENCE_C = 25.0
_POLL_S = 1e-3
_CHANNELS = 5  # gyro, x.X, x.Y, y.X, y.Y
_NOISE_BLOCK = 1024

Array = NDArray[np.float64]


@dataclass(slots=True)
class Disturbances:
    """What a self-test or a failure does to the codes of one window."""

    gyro_add_counts: float = 0.0
    tilt_add_counts: tuple[float, float] = (0.0, 0.0)
    """Of each chip: added to its X, taken from its Y."""
    gyro_stuck_code: float | None = None
    forced_tilts: dict[int, float] = field(default_factory=dict)
    """Tilt channel 0..3 (x.X, x.Y, y.X, y.Y) to the code it is forced to."""


class FirstOrder:
    """First-order low-pass at 1 kHz over rows of polls, exact for inputs held over a poll."""

    def __init__(self, bandwidth_hz: float, longest: int) -> None:
        self.decay = math.exp(-2.0 * math.pi * bandwidth_hz * _POLL_S)
        lags = np.subtract.outer(np.arange(longest), np.arange(longest))
        self._response: Array = np.where(
            lags >= 0, (1.0 - self.decay) * self.decay ** np.maximum(lags, 0), 0.0
        )
        self._memory = np.asarray(self.decay ** np.arange(1, longest + 1), np.float64)
        self._state: Array | None = None  # (channels, 1)
        self._of_length: dict[int, tuple[Array, Array]] = {}

    @property
    def white_gain(self) -> float:
        """RMS of filtered white noise of unit RMS."""
        return math.sqrt((1.0 - self.decay) / (1.0 + self.decay))

    def __call__(self, rows: Array) -> Array:
        """Filter shape (channels, polls), continuing where the last call ended."""
        polls = rows.shape[1]
        if self._state is None:
            self._state = rows[:, :1].copy()  # power was on long before: no step from zero
        if polls not in self._of_length:
            self._of_length[polls] = self._response[:polls, :polls].T, self._memory[:polls]
        response, memory = self._of_length[polls]
        filtered: Array = np.dot(rows, response)
        filtered += self._state * memory
        self._state = filtered[:, -1:]
        return filtered


class ImuSensors:
    """The three sensors, polled at 1 kHz.

    Args:
        errors: Deviations of this block.
        noise: Noise figures.
        rng: Its random numbers.
        outlier_rate_hz: Rate of polls with a garbage code.
        longest_window: Most polls that one call will average.
    """

    def __init__(
        self,
        errors: SensorErrors,
        noise: NoiseFigures,
        rng: np.random.Generator,
        outlier_rate_hz: float = 0.0,
        longest_window: int = 100,
    ) -> None:
        self._errors = errors
        self._rng = rng
        self._gyro_filter = self._filter(noise.gyro_bandwidth_hz, longest_window)
        self._tilt_filter = self._filter(noise.acc_bandwidth_hz, longest_window)
        gyro_gain = self._gyro_filter.white_gain if self._gyro_filter else 1.0
        tilt_gain = self._tilt_filter.white_gain if self._tilt_filter else 1.0
        # A difference has sqrt(2) of a channel's noise and twice its sensitivity.
        tilt_counts = noise.acc_rms_m_s2 * 2.0 * TILT_COUNTS_PER_M_S2 / math.sqrt(2.0)
        self._sd_counts = np.full((_CHANNELS, 1), tilt_counts / tilt_gain)
        self._sd_counts[0] = noise.gyro_rms_rad_s * GYRO_COUNTS_PER_RAD_S / gyro_gain
        self._noise = np.empty((_CHANNELS, 0))
        self._noise_at = 0
        self._walk_rad_s = 0.0
        self._outlier_rate_hz = outlier_rate_hz
        self._polls_to_outlier = self._draw_outlier()
        (bias_x, bias_y), (tempco_x, tempco_y) = errors.acc_bias_m_s2, errors.acc_tempco_m_s2_k
        (scale_x, scale_y), (cross_x, cross_y) = errors.acc_scale, errors.acc_cross
        # Codes are linear in rate, force x and force y: gain, and null at 25 deg C and per kelvin.
        self._gain = _counts([errors.gyro_scale, 0.0, 0.0], [0.0, scale_x, cross_x], [0.0, cross_y, scale_y])
        self._null = _counts([errors.gyro_bias_rad_s], [bias_x], [bias_y])
        self._null_tempco = _counts([errors.gyro_tempco_rad_s_k], [tempco_x], [tempco_y])
        # What X + Y is off 2048 by is shared by both channels.
        null_x, null_y = (TILT_NULL + imbalance / 2.0 for imbalance in errors.imbalance_counts)
        self._null += [[GYRO_NULL], [null_x], [null_x], [null_y], [null_y]]
        self._top = np.array([[GYRO_TOP], [TILT_TOP], [TILT_TOP], [TILT_TOP], [TILT_TOP]])

    @staticmethod
    def _filter(bandwidth_hz: float, longest: int) -> FirstOrder | None:
        return FirstOrder(bandwidth_hz, longest) if bandwidth_hz > 0.0 else None

    def average(
        self, felt: Sequence[Felt], temperature_c: float, disturbances: Disturbances | None = None
    ) -> tuple[float, tuple[float, float, float, float]]:
        """Mean gyro code and mean tilt codes (x.X, x.Y, y.X, y.Y) over all polls of `felt`."""
        codes = self.codes(felt, temperature_c, disturbances)
        gyro, *tilts = (np.add.reduce(codes, axis=1) * (1.0 / codes.shape[1])).tolist()
        return gyro, (tilts[0], tilts[1], tilts[2], tilts[3])

    def codes(
        self, felt: Sequence[Felt], temperature_c: float, disturbances: Disturbances | None = None
    ) -> Array:
        """Codes of every poll, shape (5, polls): gyro, x.X, x.Y, y.X, y.Y."""
        polls = len(felt)
        signal = self._signal(felt, temperature_c)
        signal += self._next_noise(polls)
        if self._gyro_filter:
            signal[:1] = self._gyro_filter(signal[:1])
        if self._tilt_filter:
            signal[1:] = self._tilt_filter(signal[1:])
        if disturbances:
            signal[0] += disturbances.gyro_add_counts
            for channel, counts in enumerate(disturbances.tilt_add_counts):
                signal[1 + 2 * channel] += counts
                signal[2 + 2 * channel] -= counts
        np.rint(signal, out=signal)
        np.maximum(signal, 0.0, out=signal)
        np.minimum(signal, self._top, out=signal)
        if disturbances:
            self._disturb(signal, disturbances)
        if self._outlier_rate_hz > 0.0:
            self._spoil(signal, polls)
        return signal

    def _signal(self, felt: Sequence[Felt], temperature_c: float) -> Array:
        """Noise-free codes, shape (5, polls)."""
        errors = self._errors
        warmer_k = temperature_c - REFERENCE_C
        self._walk_rad_s += (
            errors.gyro_walk_rad_s_sqrt_s * math.sqrt(len(felt) * _POLL_S) * self._rng.standard_normal()
        )
        gyro_scale = errors.gyro_scale * (1.0 + errors.gyro_scale_tempco_per_k * warmer_k)
        self._gain[0, 0] = GYRO_COUNTS_PER_RAD_S * gyro_scale
        null = self._null + self._null_tempco * warmer_k
        null[0, 0] += GYRO_COUNTS_PER_RAD_S * self._walk_rad_s
        polls = np.fromiter(chain.from_iterable(felt), np.float64, 3 * len(felt)).reshape(-1, 3)
        signal: Array = np.dot(self._gain, polls.T)
        signal += null
        return signal

    def _next_noise(self, polls: int) -> Array:
        if self._noise_at + polls > self._noise.shape[1]:
            fresh = self._rng.standard_normal((_CHANNELS, _NOISE_BLOCK)) * self._sd_counts
            self._noise = np.concatenate([self._noise[:, self._noise_at :], fresh], axis=1)
            self._noise_at = 0
        start, self._noise_at = self._noise_at, self._noise_at + polls
        return self._noise[:, start : self._noise_at]

    @staticmethod
    def _disturb(codes: Array, disturbances: Disturbances) -> None:
        if disturbances.gyro_stuck_code is not None:
            codes[0] = disturbances.gyro_stuck_code
        for channel, code in disturbances.forced_tilts.items():
            codes[1 + channel] = code

    def _draw_outlier(self) -> int:
        if self._outlier_rate_hz <= 0.0:
            return 0
        return 1 + round(self._rng.exponential(1.0 / (self._outlier_rate_hz * _POLL_S)))

    def _spoil(self, codes: Array, polls: int) -> None:
        """A disturbed SPI transfer: one poll of one channel reads any code."""
        while self._polls_to_outlier <= polls:
            channel = int(self._rng.integers(_CHANNELS))
            codes[channel, self._polls_to_outlier - 1] = self._rng.integers(int(self._top[channel, 0]) + 1)
            self._polls_to_outlier += self._draw_outlier()
        self._polls_to_outlier -= polls


def _counts(gyro_rad_s: list[float], x_m_s2: list[float], y_m_s2: list[float]) -> Array:
    """Rows of gyro and tilt chips in counts of the five channels; the second channel of a chip is opposed."""
    gyro, x, y = np.array(gyro_rad_s), np.array(x_m_s2), np.array(y_m_s2)
    tilts = TILT_COUNTS_PER_M_S2 * np.array([x, -x, y, -y])
    return np.vstack([GYRO_COUNTS_PER_RAD_S * gyro, tilts])
