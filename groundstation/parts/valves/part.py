"""Part ``valves``: the wrench becomes pulses, one choice of them, guarded commands and frames on the bus."""

from drivers.valve_bus.guard import Guard
from drivers.valve_bus.valve_budget import OpenTimeLimits
from groundstation.control.allocation import Allocator
from groundstation.control.brake import BrakeConfig
from groundstation.control.modulation import PulseConfig, PulseModulator
from groundstation.control.mux import MuxConfig
from groundstation.declarations.node import COMMANDS, FLIGHT, Node, NodeRow, Weight
from groundstation.declarations.part import Part
from groundstation.declarations.port import Port, PortRow
from groundstation.declarations.rig import LABORATORY, Rig, check_address
from groundstation.declarations.vehicle_type import VehicleType
from groundstation.parts.valves.actions import PUSH
from groundstation.parts.valves.allocation_node import AllocationNode
from groundstation.parts.valves.command_mux_node import CommandMuxNode
from groundstation.parts.valves.gauges import GAUGES
from groundstation.parts.valves.guard_node import GuardNode
from groundstation.parts.valves.messages import (
    CanIn,
    CanOut,
    ValveCommand,
    ValveDemand,
    ValveSelection,
    ValveStatus,
)
from groundstation.parts.valves.port import ValveBus
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
    """With modulators of its own for braking and for pushing by hand."""
    type_ = rig.type_of(vehicle)
    modulators = _modulator(type_), _modulator(type_)
    return CommandMuxNode(vehicle, MuxConfig(), BrakeConfig(), type_.model(), modulators)


def _guard(rig: Rig, vehicle: str) -> Node:
    limits = OpenTimeLimits(max_open_s=rig.type_of(vehicle).valves.max_open_s)
    return GuardNode(vehicle, Guard(rig.vehicle(vehicle, ValvesOfVehicle).bus_index, limits))


def _valve_writer(rig: Rig, vehicle: str) -> Node:
    return ValveWriter(vehicle, rig.vehicle(vehicle, ValvesOfVehicle).bus_index)


def _allocation(rig: Rig, vehicle: str) -> Node:
    return AllocationNode(vehicle, _modulator(rig.type_of(vehicle)))


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
    summary="the wrench becomes pulses; one source is chosen, guarded and sent over the valve bus",
    topics=(CanIn, ValveStatus, ValveDemand, ValveSelection, ValveCommand, CanOut),
    nodes=(
        NodeRow("command_mux", COMMANDS, Weight.URGENT, CommandMuxNode, _command_mux),
        NodeRow("guard", COMMANDS, Weight.URGENT, GuardNode, _guard),
        NodeRow("valve_writer", COMMANDS, Weight.URGENT, ValveWriter, _valve_writer),
        NodeRow("allocation", FLIGHT, Weight.LIGHT, AllocationNode, _allocation),
    ),
    ports=(PortRow("valve_writer", ValveBus, _port, is_of_rig=True),),
    actions=(PUSH,),
    rig=ValvesOfRig,
    vehicle=ValvesOfVehicle,
    check=_check,
    gauges=GAUGES,
)
