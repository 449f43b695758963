"""Scales of the sensors, and whether what they say can be true.

Origins: S = public source seen (Linux iio ``adis16080`` driver, AD7923 Rev. D, open drivers of the parts),
D = derived from such facts, M = data sheet from memory (ADIS16100 Rev. B, SCA103T 82 617 00 Rev. A3), to be
checked against the paper before hardware work. Signs: ``docs/interfaces/imu_block.md`` section 2.
"""

import math
from dataclasses import dataclass
from enum import IntFlag

from drivers.imu_block.block_frames import HousekeepingItem, ImuFrame, Status
from drivers.imu_block.step_limit import GYRO_STEP_COUNTS, StepLimit

STANDARD_GRAVITY_M_S2 = 9.80665  # by definition, CGPM 1901

# ADIS16100 yaw-rate gyro
GYRO_NULL_COUNTS = 2048.0  # S, nominal; tolerance about 200 counts (M)
GYRO_SCALE_RAD_S = math.radians(0.2439)  # S, per count
GYRO_RANGE_COUNTS = 1230.0  # S, +-300 deg/s around null
GYRO_TEMPERATURE_NULL_COUNTS = 2048.0  # S, at 25 degC
GYRO_TEMPERATURE_SCALE_K = 0.1453  # S and D (8.4 mV/K over 1.2207 mV); Linux has 0.1026: not followed
GYRO_NOISE_DENSITY_RAD_S_SQRT_HZ = math.radians(0.1)  # M, as ADXRS300
GYRO_BANDWIDTH_HZ = 40.0  # M and D

# SCA103T-D04 inclinometers
TILT_NULL_COUNTS = 1024.0  # M, SCA61T driver (S)
TILT_SCALE_M_S2 = STANDARD_GRAVITY_M_S2 / 6554.0  # S, per count of X - Y
TILT_BANDWIDTH_HZ = 18.0  # S
TILT_LOWEST_COUNTS = 102.0  # M, 0.25 V: failures drive the output outside
TILT_HIGHEST_COUNTS = 1945.0  # M, 4.75 V
TILT_SUM_COUNTS = 2048.0  # D, X + Y of opposed channels
TILT_SUM_TOLERANCE_COUNTS = 40.0  # D
TILT_TEMPERATURE_NULL_COUNTS = 197.0  # S, at 0 degC
TILT_TEMPERATURE_SCALE_COUNTS_K = -1.083  # S

GYRO_STUCK_POLLS = 500  # D: with 0.4 counts rms per poll, the least noise published, chance is below 1e-40


def rate_rad_s(gyro_counts: float, null_counts: float = GYRO_NULL_COUNTS) -> float:
    """Return the yaw rate, counter-clockwise positive, rad/s."""
    return (gyro_counts - null_counts) * GYRO_SCALE_RAD_S


def specific_force_m_s2(tilt_difference_counts: float) -> float:
    """Return the specific force along a chip's + axis, m/s^2, from X - Y."""
    return tilt_difference_counts * TILT_SCALE_M_S2


def temperature_gyro_c(counts: float) -> float:
    """Return the gyro chip's temperature, degC, from its 12-bit code."""
    return 25.0 + (counts - GYRO_TEMPERATURE_NULL_COUNTS) * GYRO_TEMPERATURE_SCALE_K


def temperature_tilt_c(counts: float) -> float:
    """Return an inclinometer's temperature, degC, from its 8-bit code."""
    return (counts - TILT_TEMPERATURE_NULL_COUNTS) / TILT_TEMPERATURE_SCALE_COUNTS_K


class SensorFault(IntFlag):
    """What is wrong with the readings; several may hold at once."""

    TILT_X_WINDOW = 0x01
    """A channel of chip x outside 102..1945 counts for more than one frame: a failure code, not tilt."""
    TILT_Y_WINDOW = 0x02
    TILT_X_SUM = 0x04
    """X + Y of chip x off 2048 by more than 40 for more than one frame: fault, supply or strong shock."""
    TILT_Y_SUM = 0x08
    GYRO_STEP = 0x10
    """The gyro jumped further in one frame than the mock-up can."""
    GYRO_RANGE = 0x20
    """Gyro code beyond +-300 deg/s around its null: saturated or broken."""
    REPORTED_GYRO = 0x40
    """The block's own status says so."""
    REPORTED_TILT_X = 0x80
    REPORTED_TILT_Y = 0x100
    SELF_TEST = 0x200
    """Not a fault, but the readings are not motion."""
    GYRO_STUCK = 0x400
    """The gyro's code has not changed for half a second: noise alone would have moved it."""
    ATTENTION = 0x800
    """The block draws attention to something, and has not stated what since."""


class Reading(IntFlag):
    """Which of the block's readings."""

    RATE = 0x01
    FORCE_X = 0x02
    FORCE_Y = 0x04


ALL_READINGS = Reading.RATE | Reading.FORCE_X | Reading.FORCE_Y
_RATE_FAULTS = (
    SensorFault.GYRO_STEP | SensorFault.GYRO_RANGE | SensorFault.GYRO_STUCK | SensorFault.REPORTED_GYRO
)
_X_FAULTS = SensorFault.TILT_X_WINDOW | SensorFault.TILT_X_SUM | SensorFault.REPORTED_TILT_X
_Y_FAULTS = SensorFault.TILT_Y_WINDOW | SensorFault.TILT_Y_SUM | SensorFault.REPORTED_TILT_Y


def usable_readings(faults: SensorFault) -> Reading:
    """Return the readings that a set of faults leaves usable; a self-test, or what is not known, none."""
    if not faults:
        return ALL_READINGS
    if faults & (SensorFault.SELF_TEST | SensorFault.ATTENTION):
        return Reading(0)
    usable = ALL_READINGS
    pairs = ((_RATE_FAULTS, Reading.RATE), (_X_FAULTS, Reading.FORCE_X), (_Y_FAULTS, Reading.FORCE_Y))
    for kinds, reading in pairs:
        if faults & kinds:
            usable &= ~reading
    return usable


_NO_STATUS = Status(0)
_NO_FAULT = SensorFault(0)
_LASTING = (
    SensorFault.TILT_X_WINDOW | SensorFault.TILT_Y_WINDOW | SensorFault.TILT_X_SUM | SensorFault.TILT_Y_SUM
).value


class Plausibility:
    """Judges frame after frame; a window or sum must be off for two frames before it is a fault."""

    def __init__(self) -> None:
        self._last_off = 0
        self._last_gyro_counts: float | None = None
        self._still_polls = 0
        self._steps = StepLimit(GYRO_STEP_COUNTS)
        self._is_explained = False

    def update(self, frame: ImuFrame, status: Status = _NO_STATUS) -> SensorFault:
        """Return the faults that hold with this frame.

        Args:
            frame: the next frame of one stream.
            status: latest status word of the block, this frame's included (see ``Environment``); none for v1.
        """
        off = _tilts_off(frame)
        gyro, last = frame.gyro_counts, self._last_gyro_counts
        if self._steps.is_step(gyro):
            off |= SensorFault.GYRO_STEP.value
        self._still_polls = self._still_polls + frame.sample_count if gyro == last else 0
        if self._still_polls >= GYRO_STUCK_POLLS:
            off |= SensorFault.GYRO_STUCK.value
        self._last_gyro_counts = gyro
        if abs(gyro - GYRO_NULL_COUNTS) > GYRO_RANGE_COUNTS:
            off |= SensorFault.GYRO_RANGE.value
        off |= self._reported(frame, status)
        faults = off & (self._last_off | ~_LASTING)
        self._last_off = off
        return SensorFault(faults) if faults else _NO_FAULT

    def _reported(self, frame: ImuFrame, status: Status) -> int:
        """What the block states: attention in every frame, its reason in every fourth."""
        reported = _reported(status) if int(status) & _REPORTED_BITS else 0
        if not frame.attention:
            self._is_explained = False
            return reported
        if frame.housekeeping is not None and frame.housekeeping.item == HousekeepingItem.STATUS:
            self._is_explained = bool(reported)
        return reported if self._is_explained else reported | SensorFault.ATTENTION.value


def _tilts_off(frame: ImuFrame) -> int:
    """Return the window and sum bits that this frame alone would set. Plain ints: this is the hot path."""
    if frame.tilt_counts is None:
        # Only the difference is known: beyond this one of the channels must be outside its window.
        x, y = frame.tilt_difference_counts
        widest = TILT_HIGHEST_COUNTS - TILT_LOWEST_COUNTS
        return (1 if abs(x) > widest else 0) | (2 if abs(y) > widest else 0)
    xx, xy, yx, yy = frame.tilt_counts
    low, high = TILT_LOWEST_COUNTS, TILT_HIGHEST_COUNTS
    off = 0
    if not (low <= xx <= high and low <= xy <= high):
        off |= 1
    if not (low <= yx <= high and low <= yy <= high):
        off |= 2
    if abs(xx + xy - TILT_SUM_COUNTS) > TILT_SUM_TOLERANCE_COUNTS:
        off |= 4
    if abs(yx + yy - TILT_SUM_COUNTS) > TILT_SUM_TOLERANCE_COUNTS:
        off |= 8
    return off


_REPORTED = (
    (Status.FAULT_GYRO.value, SensorFault.REPORTED_GYRO.value),
    (Status.FAULT_TILT_X.value, SensorFault.REPORTED_TILT_X.value),
    (Status.FAULT_TILT_Y.value, SensorFault.REPORTED_TILT_Y.value),
    (Status.SELF_TEST.value, SensorFault.SELF_TEST.value),
)

_REPORTED_BITS = sum(bit for bit, _ in _REPORTED)


def _reported(status: Status) -> int:
    return sum(fault for bit, fault in _REPORTED if status.value & bit)


@dataclass(slots=True)
class Environment:
    """The multiplexed slow quantities, as last received: NaN until then, and for ever with v1.

    Attributes:
        temperature_gyro_c, temperature_tilt_x_c, temperature_tilt_y_c: chip temperatures, degC.
        status: status bits of the block.
        commands_refused: commands the block refused since reset, modulo 256.
    """

    temperature_gyro_c: float = math.nan
    temperature_tilt_x_c: float = math.nan
    temperature_tilt_y_c: float = math.nan
    status: Status = _NO_STATUS
    commands_refused: int = 0

    def update(self, frame: ImuFrame) -> None:
        """Take the item that this frame carries."""
        if frame.housekeeping is None:
            return
        item, value = frame.housekeeping
        match item:
            case HousekeepingItem.TEMPERATURE_GYRO:
                self.temperature_gyro_c = temperature_gyro_c(value)
            case HousekeepingItem.TEMPERATURE_TILT_X:
                self.temperature_tilt_x_c = temperature_tilt_c(value)
            case HousekeepingItem.TEMPERATURE_TILT_Y:
                self.temperature_tilt_y_c = temperature_tilt_c(value)
            case HousekeepingItem.STATUS:
                self.status = Status(value & 0xFF)
                self.commands_refused = value >> 8
