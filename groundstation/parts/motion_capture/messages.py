"""What a motion-capture system sees, and the fixes made of it."""

from dataclasses import dataclass
from typing import ClassVar

from groundstation.declarations.fix import PoseFix
from groundstation.declarations.message import F64, PACKAGE, U32, Bool, Float64x3, Float64x4, Message, Text
from groundstation.declarations.topic import Rank, Scope, Topic


@dataclass(frozen=True, slots=True, eq=False)
class CapturedPose(Message):
    """One rigid body of one frame, as it arrived; the stamp is the arrival.

    Attributes:
        body: Name of the rigid body.
        frame: Counts the frames that were read.
        position_capture_m: Of the body's pivot in the system's frame; NaN where not tracked.
        quaternion_xyzw: Turns body axes into the system's, scalar last; NaN where not tracked.
        is_tracked: Whether the cameras saw it.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/CapturedPose"
    TOPIC: ClassVar = Topic("captured_pose", 200, Rank.SENSOR, scope=Scope.RIG)
    body: Text
    frame: U32
    position_capture_m: Float64x3
    quaternion_xyzw: Float64x4
    is_tracked: Bool


@dataclass(frozen=True, slots=True, eq=False)
class CaptureFix(PoseFix):
    """Where motion capture sees one mock-up; the stamp is the exposure.

    Attributes:
        tilt_rad: Between the body's up axis and the table's: a mock-up lies flat, a mistaken body does not.
        reason: Empty, or why there is no fix.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/CaptureFix"
    TOPIC: ClassVar = Topic("capture_fix", 100, Rank.SENSOR)
    tilt_rad: F64
    reason: Text
