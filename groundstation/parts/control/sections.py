"""Keys of a rig file for controllers: the type gives the default, a vehicle may have its own."""

from typing import Any

from pydantic import BaseModel, Field

from groundstation.control.controllers import controllers
from groundstation.control.corridor import Docking
from groundstation.declarations.rig import Rig
from groundstation.declarations.section import Section


class ControlSection(Section):
    """Which controller flies a vehicle, and its parameters as that controller defines them.

    A controller with a program of its own (a path, a leader to follow) begins it when the vehicle flies, or,
    where it ``waits``, with the request ``resume``: until then the vehicle holds its pose.
    """

    controller: str = "station"
    parameters: dict[str, Any] = Field(default_factory=dict)
    waits: bool = False


class ControlOfType(Section):
    """Keys of a type of mock-up."""

    control: ControlSection = ControlSection()


class ControlOfVehicle(Section):
    """Keys of a vehicle; what it states stands in place of its type's section."""

    control: ControlSection | None = None


def control_of(rig: Rig, vehicle: str) -> tuple[ControlSection, str]:
    """The section that holds for a vehicle, and its key in the file."""
    own = rig.vehicle(vehicle, ControlOfVehicle).control
    if own is not None:
        return own, f"vehicles.{vehicle}.control"
    return rig.of_type(vehicle, ControlOfType).control, f"mock_ups.{rig.vehicles[vehicle].mock_up}.control"


def config_of(rig: Rig, vehicle: str, section: ControlSection | None = None) -> BaseModel:
    """The checked parameters of a vehicle's controller, with what the rig states already.

    Args:
        rig: The rig.
        vehicle: Its name.
        section: Another one than the rig has for it.

    Raises:
        pydantic.ValidationError: A parameter is unknown, missing or out of range.
    """
    section = section or control_of(rig, vehicle)[0]
    row = controllers()[section.controller]
    fleet_m = {
        name: (keys.hold.x_m, keys.hold.y_m)
        for name, keys in rig.vehicles.items()
        if control_of(rig, name)[0].controller == section.controller
    }
    obstacles_m = tuple((*each.position_table_m, each.radius_m) for each in rig.table.obstacles())
    stated = row.of_rig(vehicle, fleet_m, obstacles_m)
    config: BaseModel = row.config.model_validate({**stated, **section.parameters})
    return config


def neighbours_of(rig: Rig, vehicle: str) -> tuple[str, ...]:
    """Other vehicles whose states the controller of a vehicle wants."""
    row = controllers()[control_of(rig, vehicle)[0].controller]
    return tuple(row.neighbours(config_of(rig, vehicle)))


def dockings_of(rig: Rig) -> tuple[Docking, ...]:
    """Pairs that may touch, each inside its corridor."""
    found = []
    for name in rig.vehicles:
        docks_with = controllers()[control_of(rig, name)[0].controller].docks_with(config_of(rig, name))
        if docks_with is not None:
            found.append(Docking(name, *docks_with))
    return tuple(found)
