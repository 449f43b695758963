"""What the reference system reports: truth of the emulator, or motion capture."""

from dataclasses import dataclass
from typing import ClassVar

from groundstation.declarations.message import F64, PACKAGE, Bytes, Float64x2, Message
from groundstation.declarations.topic import Topic


@dataclass(frozen=True, slots=True, eq=False)
class ReferenceBytes(Message):
    """A read of the reference stream (truth of the emulator, or motion capture)."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ReferenceBytes"
    TOPIC: ClassVar = Topic("reference_bytes", 100, observers_only=True)
    data: Bytes


@dataclass(frozen=True, slots=True, eq=False)
class ReferenceState(Message):
    """Pose and velocity by the reference system; for view, recorder and report only."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ReferenceState"
    TOPIC: ClassVar = Topic("reference", 100, observers_only=True)
    position_table_m: Float64x2
    heading_rad: F64
    velocity_table_m_s: Float64x2
    rate_rad_s: F64
