"""What fusion believes, and what became of each fix."""

from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

from groundstation.control.state import ControlState
from groundstation.declarations.message import (
    F64,
    I64,
    PACKAGE,
    U32,
    Bool,
    Float64x2,
    Float64x3,
    Message,
    Text,
    TextSequence,
)
from groundstation.declarations.topic import Rank, Topic


@dataclass(frozen=True, slots=True, eq=False)
class VehicleState(Message):
    """State of the centre of mass at the end of an IMU window.

    Attributes:
        position_table_m: x, y.
        heading_rad: In [-pi, pi).
        velocity_table_m_s: x, y.
        rate_rad_s: Bias-corrected turn rate.
        pose_sigma: Standard deviations of x, y (m) and heading (rad).
        status: ``starting``, ``resting``, ``flying`` or ``lost``.
        fix_stamp_ns: Exposure of the newest fix inside, 0 before the first.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/VehicleState"
    TOPIC: ClassVar = Topic("state", 100, Rank.ESTIMATE, pace_ns=20_000_000)
    position_table_m: Float64x2
    heading_rad: F64
    velocity_table_m_s: Float64x2
    rate_rad_s: F64
    pose_sigma: Float64x3
    status: Text
    fix_stamp_ns: I64


@lru_cache(maxsize=16)
def control_state(message: VehicleState) -> ControlState:
    """The state as control reads it, made once for all nodes of a process that receive the message.

    Raises:
        ValueError: A component is not finite.
    """
    return ControlState(
        message.position_table_m, message.velocity_table_m_s, message.heading_rad, message.rate_rad_s
    )


@dataclass(frozen=True, slots=True, eq=False)
class FixAccount(Message):
    """What fusion did with one fix of ``stars`` or ``overhead``; the stamp is the fix's exposure."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/FixAccount"
    TOPIC: ClassVar = Topic("fix_account", 15, Rank.ESTIMATE)
    source: Text
    used: Bool
    reason: Text
    innovation: Float64x3
    nis: F64
    age_s: F64


@dataclass(frozen=True, slots=True, eq=False)
class FusionStatus(Message):
    """How the estimator is doing, a few times a second.

    Attributes:
        status: As in ``VehicleState``.
        method: Row of the table of estimators.
        bias_rate_rad_s: What is subtracted from the gyro.
        bias_force_m_s2: What is subtracted from the accelerometers (body).
        rest_s: Length of the rest without a break that zero offsets are taken from: the float air off, every
            sample valid, no gap, no motion; after take-off that of the rest before it.
        fixes_used: Since start.
        fixes_refused: Since start.
        fix_age_s: Since the exposure of the newest used fix, infinity before the first.
        slope_left_m_s2: The table's pull beyond the map as estimated, table x, y; zeros where it is not.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/FusionStatus"
    TOPIC: ClassVar = Topic("fusion_status", 5, Rank.ESTIMATE)
    status: Text
    method: Text
    bias_rate_rad_s: F64
    bias_force_m_s2: Float64x2
    rest_s: F64
    fixes_used: U32
    fixes_refused: U32
    fix_age_s: F64
    slope_left_m_s2: Float64x2


@dataclass(frozen=True, slots=True, eq=False)
class FusionCalibration(Message):
    """The calibration files that estimator and controller were made from, as they were then; latched.

    Attributes:
        names: Keys of the rig, one per file.
        sha256: Of each file.
        contents: Texts of the files; that of a table map names the hash of its grid.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/FusionCalibration"
    TOPIC: ClassVar = Topic("fusion_calibration", latched=True)
    names: TextSequence
    sha256: TextSequence
    contents: TextSequence
