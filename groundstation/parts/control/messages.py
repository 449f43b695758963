"""What the controller wants, and how far it is from its goal."""

from dataclasses import dataclass
from typing import ClassVar

from groundstation.declarations.message import F64, PACKAGE, Float64x2, Message, Text, TextSequence
from groundstation.declarations.topic import Rank, Topic


@dataclass(frozen=True, slots=True, eq=False)
class Wrench(Message):
    """Force and torque asked for by the controller, body frame; z components of the other axes are 0."""

    ROS_TYPE: ClassVar[str] = "geometry_msgs/msg/WrenchStamped"
    TOPIC: ClassVar = Topic("wrench", 20, Rank.COMMAND)
    force_x_n: F64
    force_y_n: F64
    force_z_n: F64
    torque_x_nm: F64
    torque_y_nm: F64
    torque_z_nm: F64


@dataclass(frozen=True, slots=True, eq=False)
class ControlStatus(Message):
    """The setpoint that the controller works for at present, and the distance to it.

    Attributes:
        neighbours: Vehicles whose states the law wants.
        led_by: Those of them without whom it has no place of its own.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ControlStatus"
    TOPIC: ClassVar = Topic("control_status", 5, Rank.COMMAND)
    controller: Text
    goal_position_table_m: Float64x2
    goal_heading_rad: F64
    error_position_m: F64
    error_heading_rad: F64
    neighbours: TextSequence
    led_by: TextSequence
