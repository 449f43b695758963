"""Keys of a rig file for controllers: the type gives the default, a vehicle may have its own."""

from typing import Any

from pydantic import Field

from groundstation.control.controllers import controllers
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


def neighbours_of(rig: Rig, vehicle: str) -> tuple[str, ...]:
    """Other vehicles whose states the controller of a vehicle wants."""
    section = control_of(rig, vehicle)[0]
    row = controllers()[section.controller]
    return tuple(row.neighbours(row.config.model_validate(section.parameters)))
