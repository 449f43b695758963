"""What a side camera sees of another mock-up, and the leader's motion that is made of it."""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

from groundstation.control.state import ControlState
from groundstation.declarations.camera_image import CameraImage
from groundstation.declarations.message import (
    F64,
    I64,
    PACKAGE,
    U16,
    Float64x2,
    Float64x3,
    Float64x9,
    Message,
    Text,
)
from groundstation.declarations.topic import Delivery, Rank, Recorded, Topic


@dataclass(frozen=True, slots=True, eq=False)
class SideImage(CameraImage):
    """One grey picture of the camera on a hull; the stamp is its arrival."""

    TOPIC: ClassVar = Topic("side_image", 15, Rank.SENSOR, delivery=Delivery.NEWEST, recorded=Recorded.IMAGES)


@dataclass(frozen=True, slots=True, eq=False)
class RelativePose(Message):
    """Where one picture shows another mock-up; the stamp is the middle of the exposure.

    Attributes:
        seen: Name of the mock-up that is looked for.
        status: ``solved``, ``ambiguous`` (it can be understood in two ways) or ``lost``; but for the first
            one numbers are NaN.
        range_m: Between the origins of the two bodies.
        bearing_body_rad: Of the other's origin, from the own body +x, counter-clockwise.
        position_body_m: The same in the own body frame, x, y.
        relative_heading_rad: The other's heading less the own one; NaN where it cannot be seen.
        covariance: Of x, y (m) and relative heading (rad), row by row; an infinite variance says that the
            heading cannot be seen.
        stamp_sigma_s: Of the stamp.
        points: Markers used, or columns of the lit part.
        misfit_ratio: Mean square of the residuals over their sigmas.
        reason: Empty, or why it is not seen.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/RelativePose"
    TOPIC: ClassVar = Topic("relative_pose", 15, Rank.SENSOR)
    seen: Text
    status: Text
    range_m: F64
    bearing_body_rad: F64
    position_body_m: Float64x2
    relative_heading_rad: F64
    covariance: Float64x9
    stamp_sigma_s: F64
    points: U16
    misfit_ratio: F64
    reason: Text


@dataclass(frozen=True, slots=True, eq=False)
class LeaderState(Message):
    """Another mock-up by what the own camera sees of it; published with each sighting that is believed.

    It holds in the table as the own estimate has it: an error of the own place is in it as well, and is none
    of the distance.

    Attributes:
        seen: Name of the mock-up.
        position_table_m: x, y: the own place and what lies between.
        heading_rad: In [-pi, pi); NaN where it cannot be seen.
        velocity_table_m_s: x, y.
        rate_rad_s: Turn rate; 0 where the heading cannot be seen.
        apart_sigma: Standard deviations of what lies between: table x, y (m), heading (rad).
        seen_stamp_ns: Exposure of the newest sighting inside.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/LeaderState"
    TOPIC: ClassVar = Topic("leader_state", 15, Rank.ESTIMATE)
    seen: Text
    position_table_m: Float64x2
    heading_rad: F64
    velocity_table_m_s: Float64x2
    rate_rad_s: F64
    apart_sigma: Float64x3
    seen_stamp_ns: I64


@lru_cache(maxsize=8)
def leader_control_state(message: LeaderState) -> ControlState:
    """The leader as control reads it; a heading that cannot be seen is 0, which no law may use.

    Raises:
        ValueError: Another component is not finite.
    """
    heading_rad = 0.0 if math.isnan(message.heading_rad) else message.heading_rad
    return ControlState(message.position_table_m, message.velocity_table_m_s, heading_rad, message.rate_rad_s)
