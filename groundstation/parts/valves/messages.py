"""From the wrench that a controller wants to the frame on the valve bus."""

from dataclasses import dataclass
from typing import ClassVar

from groundstation.messages.base import F64, PACKAGE, U8, U32, Bool, Bytes, Float64x2, Message, Text

NO_STOP = 255
"""Stop reason of a command without a latched stop."""


@dataclass(frozen=True, slots=True, eq=False)
class Wrench(Message):
    """Force and torque asked for by the controller, body frame; z components of the other axes are 0."""

    ROS_TYPE: ClassVar[str] = "geometry_msgs/msg/WrenchStamped"
    force_x_n: F64
    force_y_n: F64
    force_z_n: F64
    torque_x_nm: F64
    torque_y_nm: F64
    torque_z_nm: F64


@dataclass(frozen=True, slots=True, eq=False)
class ControlStatus(Message):
    """The goal in force and the distance to it."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ControlStatus"
    controller: Text
    goal_position_table_m: Float64x2
    goal_heading_rad: F64
    error_position_m: F64
    error_heading_rad: F64


@dataclass(frozen=True, slots=True, eq=False)
class ValveDemand(Message):
    """On-times of the next modulation period, as the allocation asks for them.

    Attributes:
        on_time_ms: Per valve, 0 to 127.
        delivered_force_body_n: Mean force that these pulses are expected to give over the period.
        delivered_torque_nm: Mean torque, likewise.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ValveDemand"
    on_time_ms: Bytes
    delivered_force_body_n: Float64x2
    delivered_torque_nm: F64


@dataclass(frozen=True, slots=True, eq=False)
class ValveSelection(Message):
    """What the command multiplexer chose, and whose it is.

    Attributes:
        counter: Of the selections said, modulo 16.
        pulse_id: Changes with every new pulse, modulo 16.
        on_time_ms: Per valve, 0 to 127.
        source: ``stop``, ``brake``, ``operator``, ``controller`` or ``closed``.
        reason: Why this source.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ValveSelection"
    counter: U8
    pulse_id: U8
    on_time_ms: Bytes
    source: Text
    reason: Text


@dataclass(frozen=True, slots=True, eq=False)
class ValveCommand(Message):
    """What the guard lets through; sent every 20 ms, closed unless armed and fresh.

    Attributes:
        counter: Of the frames sent, modulo 16.
        pulse_id: Of the guard's own pulses, modulo 16.
        on_time_ms: Remaining on-time per valve.
        gate: ``open``, or why the valves are closed.
        open_mask: Bit i: valve i is open after this frame.
        stop_reason: Code of the latched stop, ``NO_STOP`` without one.
        arm: 0 nothing to say, 1 disarm the node, 2 arm it.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ValveCommand"
    counter: U8
    pulse_id: U8
    on_time_ms: Bytes
    gate: Text
    open_mask: U8
    stop_reason: U8
    arm: U8


@dataclass(frozen=True, slots=True, eq=False)
class CanIn(Message):
    """A CAN frame that arrived from the valve bus."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/CanIn"
    arbitration_id: U32
    data: Bytes


@dataclass(frozen=True, slots=True, eq=False)
class CanOut(Message):
    """A CAN frame for the valve bus."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/CanOut"
    arbitration_id: U32
    data: Bytes


@dataclass(frozen=True, slots=True, eq=False)
class ValveStatus(Message):
    """What the valve node of a mock-up reports.

    Attributes:
        open_mask: Bit i is valve i.
        counter: Of the command executed last.
        armed: Commands are being executed.
        dead_man: The node closed its valves because nobody spoke to it.
        floating: The float air is on.
        pressure_pa: Tank pressure, NaN before the first report.
        faults: Fault bits.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ValveStatus"
    open_mask: U8
    counter: U8
    armed: Bool
    dead_man: Bool
    floating: Bool
    pressure_pa: F64
    faults: U8
