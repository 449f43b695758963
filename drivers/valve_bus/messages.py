"""What is sent on the valve bus, as values; how it is packed is the business of `protocol`."""

import math
from dataclasses import dataclass, field
from enum import IntEnum, IntFlag

from drivers.quick_record import quickly_made
from drivers.valve_bus.frame import CanFrame

VALVES = 8
MAX_VEHICLES = 15
EVERY_VEHICLE = 15  # addressee of a stop frame that means all
MAX_ON_TIME_MS = 127  # 7 bits
COUNTER_MODULUS = 16  # 4 bits, for counters and pulse ids alike
COMMAND_PERIOD_S = 0.020
SILENCE_CLOSES_S = 0.100  # dead-man of the node and staleness limit of the guard
SILENCE_LANDS_S = 1.0  # a node without commands for so long cuts its float air
GRACE_STEPS_PER_S = 10  # a stop frame counts its grace in units of 100 ms
MAX_GRACE_S = 25.5  # 8 bits

ARM_KEY = 0xA5  # an all-zero or all-one frame never arms


class StopReason(IntEnum):
    """Why somebody stopped a vehicle; the node stops whatever the reason."""

    UNSPECIFIED = 0
    OPERATOR = 1
    GUARD = 2
    SHUTDOWN = 3


class NodeState(IntEnum):
    """State of a valve node."""

    BOOTING = 0
    DISARMED = 1
    ARMED = 2
    STOPPED = 3  # closed until armed again
    FAULTY = 4


class NodeFault(IntFlag):
    """Fault bits of a valve node."""

    SUPPLY_UNDERVOLTAGE = 1
    OVERTEMPERATURE = 2
    BUS_OFF_RECOVERED = 4
    WATCHDOG_RESET = 8


@dataclass(frozen=True, slots=True)
class Stop:
    """Close all valves, cut the float air, disarm: at once, or when a grace is over.

    Every frame with a stop identifier stops, whatever its bytes; a frame without grace stops at once.
    """

    vehicle: int
    """Addressee, or EVERY_VEHICLE."""
    reason: int = StopReason.UNSPECIFIED
    grace_s: float = 0.0
    """How long the node still obeys commands, 0 to 25.5 s; sent in whole steps of 100 ms, rounded up."""


@dataclass(frozen=True, slots=True)
class Arm:
    """Arm (or disarm) one node. Needs the key; a node starts disarmed and a stop disarms it.

    Either kind acknowledges a stop that is over. The air stays as it is.
    """

    vehicle: int
    is_armed: bool
    key: int = ARM_KEY


@dataclass(frozen=True, slots=True)
class FloatAir:
    """Switch the air of the bearings: off lands the vehicle, and dry friction stops it."""

    vehicle: int
    is_on: bool
    counter: int = 0


@quickly_made
@dataclass(frozen=True, slots=True)
class ValveCommand:
    """One frame each 20 ms per vehicle.

    A `pulse_id` that differs from the last one sets every valve's remaining on-time (0 closes it); an
    unchanged one only refreshes the dead-man.
    """

    vehicle: int
    counter: int
    """+1 modulo 16 each frame: an unchanged counter is a repeated frame and refreshes nothing."""
    pulse_id: int
    on_times_ms: tuple[int, ...]
    """One per valve, 0..127 ms."""


@quickly_made
@dataclass(frozen=True, slots=True)
class ValveStatus:
    """What a node does, each 20 ms."""

    vehicle: int
    open_mask: int
    """Bit i: valve i is driven open."""
    executed_counter: int
    """Counter of the last command accepted."""
    executed_pulse_id: int
    counter: int
    is_armed: bool
    is_dead_man_closed: bool
    """Closed because commands fell silent for 100 ms."""
    is_stopped: bool
    is_float_air_on: bool
    valve_fault_mask: int = 0
    """Bit i: the driver of valve i sees an open or shorted coil."""
    node_faults: int = 0
    """Bits of NodeFault."""
    rejected_commands: int = 0
    """Commands with a repeated counter, modulo 256."""
    is_stop_pending: bool = False
    """A stop was received and its grace still runs."""
    is_landed_by_silence: bool = False
    """Air cut and disarmed because commands were silent for 1 s; until armed, disarmed or floated again."""


@dataclass(frozen=True, slots=True)
class TankPressure:
    """Gas supply of a vehicle; NaN where it has no sensor."""

    vehicle: int
    tank_pa: float
    supply_pa: float
    """Behind the regulator: what the valves see."""
    gas_temperature_k: float = math.nan


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """A node is alive, each 200 ms."""

    vehicle: int
    uptime_ms: int
    state: NodeState
    firmware_version: tuple[int, int] = (0, 0)
    can_error_count: int = 0


@dataclass(frozen=True, slots=True)
class Undecodable:
    """A frame that is none of ours, or too short or out of range: to be counted."""

    frame: CanFrame = field(repr=False)
    reason: str


ValveBusMessage = Stop | Arm | FloatAir | ValveCommand | ValveStatus | TankPressure | Heartbeat
