"""Wire format of the valve bus: messages to CAN frames and back, pure.

The layout's one authority is `valves.dbc`, which describes vehicle 0; vehicle v adds v to every identifier
(`docs/interfaces/valve_bus.md`). cantools packs by it, but for the frames that pass fifty times a second:
those are packed as integers by the DBC's own bits, for a tenth of the time.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib.resources import files

from cantools.database.can import Database
from cantools.database.errors import DecodeError, EncodeError

from drivers.valve_bus.frame import CanFrame
from drivers.valve_bus.integer_frame import IntegerFrame
from drivers.valve_bus.messages import (
    ARM_KEY,
    COMMAND_PERIOD_S,
    COUNTER_MODULUS,
    EVERY_VEHICLE,
    GRACE_STEPS_PER_S,
    MAX_GRACE_S,
    MAX_ON_TIME_MS,
    MAX_VEHICLES,
    SILENCE_CLOSES_S,
    SILENCE_LANDS_S,
    VALVES,
    Arm,
    FloatAir,
    Heartbeat,
    NodeFault,
    NodeState,
    Stop,
    StopReason,
    TankPressure,
    Undecodable,
    ValveBusMessage,
    ValveCommand,
    ValveStatus,
)

__all__ = [
    "ARM_ID", "ARM_KEY", "COMMAND_ID", "COMMAND_PERIOD_S", "COUNTER_MODULUS", "EVERY_VEHICLE",
    "FLOAT_AIR_ID", "HEARTBEAT_ID", "MAX_GRACE_S", "MAX_ON_TIME_MS", "MAX_VEHICLES", "PRESSURE_ID",
    "SILENCE_CLOSES_S", "SILENCE_LANDS_S", "STATUS_ID", "STOP_ID", "VALVES", "Arm", "CanFrame", "FloatAir",
    "Heartbeat", "NodeFault", "NodeState", "Stop", "StopReason", "TankPressure", "Undecodable",
    "ValveBusMessage", "ValveCommand", "ValveStatus", "database", "decode", "encode", "may_concern",
]  # fmt: skip

STOP_ID = 0x000
ARM_ID = 0x040
FLOAT_AIR_ID = 0x080
COMMAND_ID = 0x100
STATUS_ID = 0x180
PRESSURE_ID = 0x200
HEARTBEAT_ID = 0x280
_VEHICLE_BITS = 0x00F
_NO_SENSOR = "no_sensor"  # value table of TankPressure in valves.dbc

Signals = Mapping[str, int | float | str]


@cache
def database() -> Database:
    """The messages of vehicle 0, as `valves.dbc` describes them; read once."""
    loaded = Database()
    loaded.add_dbc_string(files("drivers.valve_bus").joinpath("valves.dbc").read_text(encoding="utf-8"))
    return loaded


def encode(message: ValveBusMessage) -> CanFrame:
    """The frame of a message.

    Raises:
        ValueError: A field does not fit its bits.
    """
    last_vehicle = EVERY_VEHICLE if isinstance(message, Stop) else MAX_VEHICLES - 1
    if not 0 <= message.vehicle <= last_vehicle:
        raise ValueError(f"vehicle index {message.vehicle} is outside 0..{last_vehicle}")
    match message:
        case ValveCommand():
            data = _hot_frame(COMMAND_ID).pack(_command_values(message))
            return CanFrame(COMMAND_ID + message.vehicle, data)
        case ValveStatus():
            data = _hot_frame(STATUS_ID).pack(_status_values(message))
            return CanFrame(STATUS_ID + message.vehicle, data)
    base_id, signals = _signals(message)
    try:
        data = database().get_message_by_frame_id(base_id).encode(signals)
    except (EncodeError, OverflowError) as error:
        raise ValueError(f"{type(message).__name__} does not fit its frame: {error}") from error
    if isinstance(message, Stop) and message.grace_s == 0.0:
        data = data[:1]  # no grace is no second byte, as before there was one
    return CanFrame(base_id + message.vehicle, data)


def may_concern(arbitration_id: int, vehicle: int) -> bool:
    """Whether a frame may say something to or of a vehicle: it names that one, or all."""
    return arbitration_id & _VEHICLE_BITS in (vehicle, EVERY_VEHICLE)


def decode(frame: CanFrame) -> ValveBusMessage | Undecodable:
    """The message of a frame; never raises, since the bus may carry other people's frames."""
    base_id, vehicle = frame.arbitration_id & ~_VEHICLE_BITS, frame.arbitration_id & _VEHICLE_BITS
    if base_id == STOP_ID:  # stops whatever its bytes, so none may keep it from being understood
        reason = frame.data[0] if frame.data else StopReason.UNSPECIFIED
        steps = frame.data[1] if len(frame.data) > 1 else 0
        return Stop(vehicle, reason, steps / GRACE_STEPS_PER_S)
    if vehicle >= MAX_VEHICLES or (base_id not in _FROM_VALUES and base_id not in _FROM_SIGNALS):
        return Undecodable(frame, "foreign_identifier")
    from_values = _FROM_VALUES.get(base_id)
    if from_values is not None:
        hot = _hot_frame(base_id)
        if len(frame.data) != hot.length:
            return Undecodable(frame, "wrong_length")
        return from_values(vehicle, hot.unpack(frame.data))
    layout = database().get_message_by_frame_id(base_id)
    if len(frame.data) != layout.length:
        return Undecodable(frame, "wrong_length")
    try:
        return _FROM_SIGNALS[base_id](
            vehicle, layout.decode(frame.data, decode_choices=base_id == PRESSURE_ID)
        )
    except (DecodeError, ValueError):
        return Undecodable(frame, "value_out_of_range")


def _signals(message: TankPressure | Heartbeat | Stop | Arm | FloatAir) -> tuple[int, Signals]:
    match message:
        case TankPressure():
            return PRESSURE_ID, {
                "Tank": _sensor(message.tank_pa),
                "Supply": _sensor(message.supply_pa),
                "GasTemperature": _sensor(message.gas_temperature_k),
            }
        case Heartbeat():
            return HEARTBEAT_ID, {
                "Uptime": message.uptime_ms,
                "State": int(message.state),
                "FirmwareMajor": message.firmware_version[0],
                "FirmwareMinor": message.firmware_version[1],
                "CanErrorCount": message.can_error_count,
            }
        case Stop():
            return STOP_ID, {"Reason": int(message.reason), "Grace": _whole_steps(message.grace_s)}
        case Arm():
            return ARM_ID, {"IsArmed": message.is_armed, "Key": message.key}
    return FLOAT_AIR_ID, {"IsOn": message.is_on, "Counter": message.counter}


def _whole_steps(grace_s: float) -> float:
    """Rounded up, since 0 would be a stop at once."""
    if not 0.0 <= grace_s <= MAX_GRACE_S:
        raise ValueError(f"a grace of {grace_s} s is outside 0..{MAX_GRACE_S}")
    steps = math.ceil(round(grace_s * GRACE_STEPS_PER_S, 6))  # 0.3 * 10 is a hair above 3
    return (max(1, steps) if grace_s > 0.0 else 0) / GRACE_STEPS_PER_S


def _sensor(value: float) -> float | str:
    return _NO_SENSOR if math.isnan(value) else value


def _reading(value: object) -> float:
    return float(value) if isinstance(value, int | float) else math.nan


def _command_values(message: ValveCommand) -> tuple[int, ...]:
    if len(message.on_times_ms) != VALVES:
        raise ValueError(f"a command has {VALVES} on-times, got {len(message.on_times_ms)}")
    return message.counter, message.pulse_id, *message.on_times_ms


def _command(vehicle: int, values: Sequence[int]) -> ValveCommand:
    return ValveCommand(vehicle, values[0], values[1], tuple(values[2:]))


def _status_values(message: ValveStatus) -> tuple[int, ...]:
    return (
        message.open_mask,
        message.executed_counter,
        message.executed_pulse_id,
        message.is_armed,
        message.is_dead_man_closed,
        message.is_stopped,
        message.is_float_air_on,
        message.counter,
        message.valve_fault_mask,
        int(message.node_faults),
        message.is_stop_pending,
        message.is_landed_by_silence,
        message.rejected_commands,
    )


def _status(vehicle: int, values: Sequence[int]) -> ValveStatus:
    mask, executed, pulse, armed, dead_man, stopped, floating, counter, faulty, node_faults, *rest = values
    is_pending, is_landed, rejected = rest
    return ValveStatus(
        vehicle=vehicle,
        open_mask=mask,
        executed_counter=executed,
        executed_pulse_id=pulse,
        counter=counter,
        is_armed=bool(armed),
        is_dead_man_closed=bool(dead_man),
        is_stopped=bool(stopped),
        is_float_air_on=bool(floating),
        valve_fault_mask=faulty,
        node_faults=node_faults,
        rejected_commands=rejected,
        is_stop_pending=bool(is_pending),
        is_landed_by_silence=bool(is_landed),
    )


_ORDER = {
    COMMAND_ID: ("Counter", "PulseId", *(f"OnTime{valve}" for valve in range(VALVES))),
    STATUS_ID: (
        "OpenMask", "ExecutedCounter", "ExecutedPulseId", "IsArmed", "IsDeadManClosed", "IsStopped",
        "IsFloatAirOn", "Counter", "ValveFaultMask", "NodeFaults", "IsStopPending", "IsLandedBySilence",
        "RejectedCommands",
    ),
}  # fmt: skip
"""Signals of the frames packed here, as `_command` and `_status` count them."""


@cache
def _hot_frame(base_id: int) -> IntegerFrame:
    frame = IntegerFrame(database().get_message_by_frame_id(base_id))
    if frame.names != _ORDER[base_id]:
        raise ValueError(f"valves.dbc: signals of {base_id:#x} are {frame.names}, expected {_ORDER[base_id]}")
    return frame


def _pressure(vehicle: int, signals: Mapping[str, object]) -> TankPressure:
    return TankPressure(
        vehicle,
        tank_pa=_reading(signals["Tank"]),
        supply_pa=_reading(signals["Supply"]),
        gas_temperature_k=_reading(signals["GasTemperature"]),
    )


def _heartbeat(vehicle: int, signals: Mapping[str, int]) -> Heartbeat:
    version = signals["FirmwareMajor"], signals["FirmwareMinor"]
    state = NodeState(signals["State"])
    return Heartbeat(vehicle, signals["Uptime"], state, version, signals["CanErrorCount"])


def _arm(vehicle: int, signals: Mapping[str, int]) -> Arm:
    return Arm(vehicle, bool(signals["IsArmed"]), signals["Key"])


def _float_air(vehicle: int, signals: Mapping[str, int]) -> FloatAir:
    return FloatAir(vehicle, bool(signals["IsOn"]), signals["Counter"])


_FROM_SIGNALS: dict[int, Callable[..., ValveBusMessage]] = {
    ARM_ID: _arm,
    FLOAT_AIR_ID: _float_air,
    PRESSURE_ID: _pressure,
    HEARTBEAT_ID: _heartbeat,
}
_FROM_VALUES: dict[int, Callable[[int, Sequence[int]], ValveBusMessage]] = {
    COMMAND_ID: _command,
    STATUS_ID: _status,
}
