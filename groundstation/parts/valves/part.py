"""Part ``valves``: one wrench is chosen, filtered, made into pulses, guarded and sent over the bus."""

from drivers.valve_bus.guard import Guard
from drivers.valve_bus.valve_budget import OpenTimeLimits
from groundstation.control.allocation import Allocator
from groundstation.control.brake import BrakeConfig
from groundstation.control.braking import Braking
from groundstation.control.modulation import PulseConfig, PulseModulator
from groundstation.control.mux import CommandMux, MuxConfig
from groundstation.control.safety_filter import SafetyFilter, SafetyFilterConfig
from groundstation.control.surroundings import Surroundings
from groundstation.declarations.node import COMMANDS, Node, NodeRow, Weight
from groundstation.declarations.part import Part
from groundstation.declarations.port import Port, PortRow
from groundstation.declarations.rig import LABORATORY, MOCK_UP_RADIUS_M, Rig, check_address
from groundstation.declarations.vehicle_type import VehicleType
from groundstation.parts.control.sections import dockings_of
from groundstation.parts.valves.actions import PUSH
from groundstation.parts.valves.command_mux_node import CommandMuxNode
from groundstation.parts.valves.gauges import GAUGES
from groundstation.parts.valves.guard_node import GuardNode
from groundstation.parts.valves.messages import (
    CanIn,
    CanOut,
    Outlook,
    OutsideControl,
    ValveCommand,
    ValveDemand,
    ValveSelection,
    ValveStatus,
)
from groundstation.parts.valves.port import ValveBus
from groundstation.parts.valves.safe_wish import SafeWish
from groundstation.parts.valves.sections import ValvesOfRig, ValvesOfVehicle
from groundstation.parts.valves.valve_writer import ValveWriter


def _modulator(type_: VehicleType) -> PulseModulator:
    valves = type_.valves
    config = PulseConfig(
        period_s=valves.period_s,
        min_on_s=valves.min_on_s,
        open_delay_s=valves.open_delay_s,
        close_delay_s=valves.close_delay_s,
    )
    return PulseModulator(Allocator(type_.model()), config)


def _command_mux(rig: Rig, vehicle: str) -> Node:
    type_ = rig.type_of(vehicle)
    model, modulator = type_.model(), _modulator(type_)
    period_ns = round(modulator.config.period_s * 1e9)
    braking = Braking(BrakeConfig(), model, modulator.envelope, period_ns)
    safety = SafeWish(
        vehicle,
        braking,
        SafetyFilter(SafetyFilterConfig(), rig.table.keep_in()),
        Surroundings(MOCK_UP_RADIUS_M, rig.table.obstacles()),
        model,
        dockings_of(rig),
    )
    others = tuple(name for name in rig.vehicles if name != vehicle)
    return CommandMuxNode(vehicle, others, CommandMux(MuxConfig()), braking, safety, modulator)


def _guard(rig: Rig, vehicle: str) -> Node:
    limits = OpenTimeLimits(max_open_s=rig.type_of(vehicle).valves.max_open_s)
    return GuardNode(vehicle, Guard(rig.vehicle(vehicle, ValvesOfVehicle).bus_index, limits))


def _valve_writer(rig: Rig, vehicle: str) -> Node:
    return ValveWriter(vehicle, rig.vehicle(vehicle, ValvesOfVehicle).bus_index)


def _port(rig: Rig, vehicle: str) -> Port:
    del vehicle
    return ValveBus("valve_bus", "", rig.section(ValvesOfRig).valve_bus, tuple(rig.vehicles))


def _check(rig: Rig) -> None:
    bus = rig.section(ValvesOfRig).valve_bus
    if isinstance(bus, str):
        if not bus.startswith(LABORATORY):
            raise ValueError(f"valve_bus: expected a table with 'interface' and 'channel', found {bus!r}")
        check_address(rig, "valve_bus", bus)
    else:
        import can

        interface = bus.get("interface")
        for key in ("interface", "channel"):
            if key not in bus:
                raise ValueError(f"valve_bus: the key {key!r} is missing")
        if interface not in can.VALID_INTERFACES:
            known = ", ".join(sorted(can.VALID_INTERFACES))
            raise ValueError(f"valve_bus.interface: {interface!r} is none of python-can's: {known}")
        check_address(rig, "valve_bus.channel", str(bus["channel"]))
    owners: dict[int, str] = {}
    for name in rig.vehicles:
        index = rig.vehicle(name, ValvesOfVehicle).bus_index
        if index in owners:
            raise ValueError(f"vehicles.{name}.bus_index: {index} is already that of {owners[index]}")
        owners[index] = name


PART = Part(
    name="valves",
    summary="one wrench is chosen, filtered for safety, made into pulses, guarded and sent over the bus",
    topics=(CanIn, ValveStatus, ValveDemand, ValveSelection, Outlook, OutsideControl, ValveCommand, CanOut),
    nodes=(
        NodeRow("command_mux", COMMANDS, Weight.URGENT, CommandMuxNode, _command_mux),
        NodeRow("guard", COMMANDS, Weight.URGENT, GuardNode, _guard),
        NodeRow("valve_writer", COMMANDS, Weight.URGENT, ValveWriter, _valve_writer),
    ),
    ports=(PortRow("valve_writer", ValveBus, _port, is_of_rig=True),),
    actions=(PUSH,),
    rig=ValvesOfRig,
    vehicle=ValvesOfVehicle,
    check=_check,
    gauges=GAUGES,
)
