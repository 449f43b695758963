"""What the IMU block states, from bytes to calibrated samples."""

from dataclasses import dataclass
from typing import ClassVar

from groundstation.declarations.message import (
    F64,
    PACKAGE,
    U8,
    U16,
    U32,
    U64,
    Bool,
    Bytes,
    Float64Sequence,
    Float64x2,
    Message,
    Text,
)
from groundstation.declarations.topic import Rank, Topic


@dataclass(frozen=True, slots=True, eq=False)
class ImuBytes(Message):
    """A read of the IMU block's serial port; the stamp is the arrival of its last byte.

    Attributes:
        data: The bytes.
        latency_timer_s: So long the adapter holds a byte back, as its driver reports; NaN if unknown.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ImuBytes"
    TOPIC: ClassVar = Topic("imu_bytes", 100, Rank.SENSOR)
    data: Bytes
    latency_timer_s: F64


@dataclass(frozen=True, slots=True, eq=False)
class ImuOrder(Message):
    """Bytes for the IMU block (set averaging, self-test, ...), ready to be written."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ImuOrder"
    TOPIC: ClassVar = Topic("imu_order", rank=Rank.COMMAND)
    data: Bytes


@dataclass(frozen=True, slots=True, eq=False)
class ImuRaw(Message):
    """One frame of the IMU block in counts, as the driver parsed it.

    Attributes:
        version: Frame version, 1 or 2.
        tick_ms: Unwrapped 1 kHz tick of the MCU at the end of the averaging window.
        sample_count: Polls averaged.
        gyro_counts: Averaged offset-binary code.
        tilt_counts: x.X, x.Y, y.X, y.Y; empty where the frame has none (version 1).
        tilt_difference_counts: X - Y of the x and of the y chip.
        status: Status bits of the firmware last received, 0 if none.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ImuRaw"
    TOPIC: ClassVar = Topic("imu_raw", 100, Rank.SENSOR)
    version: U8
    tick_ms: U64
    sample_count: U16
    gyro_counts: F64
    tilt_counts: Float64Sequence
    tilt_difference_counts: Float64x2
    status: U16


USABLE_RATE, USABLE_FORCE_X, USABLE_FORCE_Y = 1, 2, 4
"""Bits of `Imu.usable`."""


@dataclass(frozen=True, slots=True, eq=False)
class Imu(Message):
    """Calibrated averages over one window; the stamp is the END of the window.

    Attributes:
        tick_ms: Unwrapped 1 kHz tick of the MCU at the end of the window; begins anew with the block.
        elapsed_ms: Ticks since the sample before, 0 after a restart: what an integration has to use.
        window_s: Length of the averaging window by the MCU's clock.
        stamp_sigma_s: Standard deviation of the stamp, phase bias included.
        rate_body_rad_s: Turn rate about body z, scale applied, zero offset not removed.
        force_body_m_s2: Specific force along body x, y; zero offset not removed.
        temperature_c: Temperature of the block, NaN where unknown.
        valid: False where a plausibility check failed.
        usable: What is usable all the same: bit 0 the rate, bits 1 and 2 the forces x and y; 7 if valid.
        reason: Empty, or the failed check.
        frames_lost: Frames missing so far between MCU and here, by tick or sequence.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ImuSample"
    TOPIC: ClassVar = Topic("imu", 100, Rank.SENSOR)
    tick_ms: U64
    elapsed_ms: U32
    window_s: F64
    stamp_sigma_s: F64
    rate_body_rad_s: F64
    force_body_m_s2: Float64x2
    temperature_c: F64
    valid: Bool
    reason: Text
    frames_lost: U32
    usable: U8
