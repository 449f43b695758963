"""What the IMU block states: sample frames and replies, as plain frozen values in sensor counts."""

from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import NamedTuple

TICK_NS = 1_000_000
"""Nominal period of the microcontroller's poll, ns (1 kHz)."""

FIXED_POINT = 16
"""Averaged codes travel in sixteenths of a count."""

GYRO_CODE_MAX = 4095
TILT_CODE_MAX = 2047


class HousekeepingItem(IntEnum):
    """Which slow quantity a v2 frame carries besides its sample."""

    TEMPERATURE_GYRO = 0
    TEMPERATURE_TILT_X = 1
    TEMPERATURE_TILT_Y = 2
    STATUS = 3


class Status(IntFlag):
    """Status word of the block (housekeeping item 3). Bits 8..15 count refused commands, modulo 256."""

    RESET_POWER_ON = 0x01
    RESET_BROWN_OUT = 0x02
    RESET_WATCHDOG = 0x04
    RECEIVER_OVERRUN = 0x08
    FAULT_GYRO = 0x10
    FAULT_TILT_X = 0x20
    FAULT_TILT_Y = 0x40
    SELF_TEST = 0x80


class Housekeeping(NamedTuple):
    """One multiplexed item: raw temperature code of a chip, or the status word."""

    item: HousekeepingItem
    value: int


class ImuFrame(NamedTuple):
    """One averaged sample as it came over the wire; a named tuple, since a thousand are made a second.

    Attributes:
        version: 1 (legacy frame) or 2.
        sequence: frame counter modulo 256 (v1), None in v2.
        tick_ms: 1 kHz tick of the window's last poll modulo 65536 (v2), None in v1.
        sample_count: polls averaged. v1 does not transmit it: it is the parser's setting.
        gyro_counts: mean gyro code, offset binary, 2048 nominal at rest.
        tilt_counts: mean codes (chip x channel X, x.Y, y.X, y.Y), 1024 nominal; None in v1.
        tilt_difference_counts: X - Y of chip x and chip y, 0 nominal.
        housekeeping: multiplexed item; None in v1, and where no chip can have given the value.
        attention: v2: a sensor fault or self-test bit is set in the status word.
        end_offset: index of the frame's last byte in the chunk that completed it. Negative for a v1 frame
            that was held back from an earlier chunk until the lock was confirmed.
    """

    version: int
    sequence: int | None
    tick_ms: int | None
    sample_count: int
    gyro_counts: float
    tilt_counts: tuple[float, float, float, float] | None
    tilt_difference_counts: tuple[float, float]
    housekeeping: Housekeeping | None
    attention: bool
    end_offset: int


class AckResult(IntEnum):
    """How the block answered a command."""

    DONE = 0
    UNKNOWN_COMMAND = 1
    BAD_ARGUMENT = 2
    BUSY = 3


@dataclass(frozen=True, slots=True)
class Ack:
    """Answer to set-averaging, self-test and reset: the command's tag and type, and what became of it."""

    tag: int
    command: int
    result: int


@dataclass(frozen=True, slots=True)
class Pong:
    """Answer to a ping: the tag and the block's tick when it answered."""

    tag: int
    tick_ms: int


@dataclass(frozen=True, slots=True)
class Identity:
    """Answer to identify: which firmware on which block."""

    tag: int
    protocol_version: int
    firmware_major: int
    firmware_minor: int
    serial_number: int
    sample_count: int


Reply = Ack | Pong | Identity
