"""From the demand for pulses to the frame on the valve bus, and what the valve node reports."""

from dataclasses import dataclass
from typing import ClassVar

from groundstation.declarations.message import F64, PACKAGE, U8, U32, Bool, Bytes, Float64x2, Message, Text
from groundstation.declarations.topic import Rank, Scope, Topic

NO_STOP = 255
"""Stop reason of a command without a latched stop."""


@dataclass(frozen=True, slots=True, eq=False)
class ValveDemand(Message):
    """The pulses of the next modulation period: what was wanted, what the safety filter left, what they give.

    Attributes:
        on_time_ms: Per valve, 0 to 127.
        source: Whose wish it is; see ``ValveSelection``.
        wanted_force_body_n: Mean force over the period that was asked for.
        wanted_torque_nm: Torque, likewise.
        limited_by: What the safety filter changed it for; empty where it did not.
        delivered_force_body_n: Mean force that these pulses are expected to give over the period.
        delivered_torque_nm: Torque, likewise.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ValveDemand"
    TOPIC: ClassVar = Topic("valve_demand", 10, Rank.COMMAND)
    on_time_ms: Bytes
    source: Text
    wanted_force_body_n: Float64x2
    wanted_torque_nm: F64
    limited_by: Text
    delivered_force_body_n: Float64x2
    delivered_torque_nm: F64


@dataclass(frozen=True, slots=True, eq=False)
class ValveSelection(Message):
    """What the command multiplexer chose, and whose it is.

    Attributes:
        counter: Of the selections reported, modulo 16.
        pulse_id: Changes with every new pulse, modulo 16.
        on_time_ms: Per valve, 0 to 127.
        source: ``brake``, ``operator``, ``outside``, ``controller`` or ``closed``.
        reason: Why this source.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ValveSelection"
    TOPIC: ClassVar = Topic("valve_selection", 50, Rank.COMMAND)
    counter: U8
    pulse_id: U8
    on_time_ms: Bytes
    source: Text
    reason: Text


@dataclass(frozen=True, slots=True, eq=False)
class OutsideControl(Message):
    """Which program outside the station has the vehicle; latched, published when that changes.

    Attributes:
        author: Whose program; empty while the controller has it.
        is_silent: Nothing that counts comes from it: the vehicle brakes and waits.
        reason: Why it has the vehicle no more, or why it counts as silent.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/OutsideControl"
    TOPIC: ClassVar = Topic("outside_control", rank=Rank.VALVES, latched=True)
    author: Text
    is_silent: Bool
    reason: Text


@dataclass(frozen=True, slots=True, eq=False)
class Outlook(Message):
    """Whether the mock-up can still stop, ten times a second while it flies.

    Attributes:
        time_to_edge_s: When coasting leaves its part of the table; infinite when it never does.
        stopping_distance_m: Length of the way to rest at the thrust of the valves that work.
        edge_room_m: Distance to the edge that is left after stopping.
        nearest: Name of the other mock-up, or of the obstacle, that is met first; empty where none is.
        nearest_room_m: Between the bodies after both have stopped.
        limited_by: What the safety filter changes commands for at present; empty where it does not.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/Outlook"
    TOPIC: ClassVar = Topic("outlook", 10, Rank.COMMAND)
    time_to_edge_s: F64
    stopping_distance_m: F64
    edge_room_m: F64
    nearest: Text
    nearest_room_m: F64
    limited_by: Text


@dataclass(frozen=True, slots=True, eq=False)
class ValveCommand(Message):
    """What the guard lets through; sent every 20 ms, closed unless armed and fresh.

    Attributes:
        counter: Of the frames sent, modulo 16.
        pulse_id: Of the guard's own pulses, modulo 16.
        on_time_ms: Remaining on-time per valve.
        gate: ``open``, or why the valves are closed.
        open_mask: Bit i: valve i is open after this frame.
        stop_reason: Code of the latched or announced stop, ``NO_STOP`` without one.
        stop_grace_s: After this time the valve node is to land by itself; 0 at once.
        arm: 0 nothing to say, 1 disarm the node, 2 arm it.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ValveCommand"
    TOPIC: ClassVar = Topic("valve_command", 50, Rank.COMMAND)
    counter: U8
    pulse_id: U8
    on_time_ms: Bytes
    gate: Text
    open_mask: U8
    stop_reason: U8
    stop_grace_s: F64
    arm: U8


@dataclass(frozen=True, slots=True, eq=False)
class CanIn(Message):
    """A CAN frame that arrived from the valve bus.

    Attributes:
        arbitration_id, data: Of the frame.
        passed: Frames that the bus carried since the one before, those that nobody here wants included.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/CanIn"
    TOPIC: ClassVar = Topic("can_in", 100, Rank.VALVES, scope=Scope.RIG)
    arbitration_id: U32
    data: Bytes
    passed: U32


@dataclass(frozen=True, slots=True, eq=False)
class CanOut(Message):
    """A CAN frame for the valve bus."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/CanOut"
    TOPIC: ClassVar = Topic("can_out", 50, Rank.COMMAND)
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
        faults: Fault bits as the node reports them; bit 7: it reports an open or shorted coil.
        bus_rate_hz: Frames that arrive from the bus, of all nodes together.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/ValveStatus"
    TOPIC: ClassVar = Topic("valve_status", 50, Rank.VALVES)
    open_mask: U8
    counter: U8
    armed: Bool
    dead_man: Bool
    floating: Bool
    pressure_pa: F64
    faults: U8
    bus_rate_hz: F64
