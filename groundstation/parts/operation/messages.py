"""How a rig is run: requests, modes, calibrations, health, journal, latency."""

from dataclasses import dataclass
from typing import ClassVar

from groundstation.messages.base import (
    PACKAGE,
    U8,
    U32,
    Bool,
    Bytes,
    Float64Sequence,
    Message,
    Text,
    TextSequence,
)


@dataclass(frozen=True, slots=True, eq=False)
class Request(Message):
    """Something asked of a vehicle; answered on ``ack``.

    Attributes:
        request_id: Unique per author.
        author: Who asks.
        action: A row of the table of actions: arm, disarm, stop, release, float_on, float_off, go_to, ...
        argument: Numbers of the action, for ``go_to``: x, y (m), heading (rad).
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/Request"
    request_id: U32
    author: Text
    action: Text
    argument: Float64Sequence


@dataclass(frozen=True, slots=True, eq=False)
class Ack(Message):
    """The answer to a request."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/Ack"
    request_id: U32
    author: Text
    action: Text
    accepted: Bool
    reason: Text


@dataclass(frozen=True, slots=True, eq=False)
class VehicleMode(Message):
    """Armed state and the reason for it; latched."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/VehicleMode"
    armed: Bool
    stopped: Bool
    source: Text
    reason: Text


@dataclass(frozen=True, slots=True, eq=False)
class SequencePhase(Message):
    """Where the start sequence of a mock-up is; latched."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/SequencePhase"
    phase: Text
    detail: Text


@dataclass(frozen=True, slots=True, eq=False)
class CalibrationInUse(Message):
    """A calibration file as loaded, with its hash; latched."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/CalibrationInUse"
    name: Text
    sha256: Text
    content: Text


@dataclass(frozen=True, slots=True, eq=False)
class Diagnostics(Message):
    """Counters and health of one node, once a second."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/Diagnostics"
    node: Text
    level: U8
    summary: Text
    keys: TextSequence
    values: TextSequence


@dataclass(frozen=True, slots=True, eq=False)
class Journal(Message):
    """What one process consumed and said, in order: packed entries of ``runtime.journal``."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/Journal"
    process: Text
    names: TextSequence
    entries: Bytes


@dataclass(frozen=True, slots=True, eq=False)
class Latency(Message):
    """Ages along the chain from light to valve, per vehicle, over the last seconds.

    Attributes:
        stages: Names, in the order of the chain.
        p50_s: Median age per stage.
        p99_s: 99th percentile per stage.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/Latency"
    stages: TextSequence
    p50_s: Float64Sequence
    p99_s: Float64Sequence
