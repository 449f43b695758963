"""What the range finder reports, from bytes to a distance."""

from dataclasses import dataclass
from typing import ClassVar

from groundstation.declarations.message import F64, U32, Bool, Bytes, Message
from groundstation.declarations.topic import Rank, Topic

PACKAGE = "range_finder_msgs"
"""ROS 2 package of these types, for recordings and bridges."""


@dataclass(frozen=True, slots=True, eq=False)
class RangeBytes(Message):
    """A read of the serial port; the stamp is the arrival of its last byte."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/RangeBytes"
    TOPIC: ClassVar = Topic("range_bytes", 10, Rank.SENSOR)
    data: Bytes


@dataclass(frozen=True, slots=True, eq=False)
class Range(Message):
    """Distance from the device along body +x; the stamp is the moment of the measurement.

    Attributes:
        has_echo: Whether something was in reach.
        distance_m: NaN without an echo.
        sigma_m: Its standard deviation, by the rig.
        lines_lost: Measurements that did not arrive, so far.
        lines_refused: Damaged lines, so far.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/Range"
    TOPIC: ClassVar = Topic("range", 10, Rank.SENSOR)
    has_echo: Bool
    distance_m: F64
    sigma_m: F64
    lines_lost: U32
    lines_refused: U32
