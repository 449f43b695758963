"""Keys of a rig file for the valve bus."""

from typing import Any

from pydantic import Field

from drivers.valve_bus.messages import MAX_VEHICLES
from groundstation.declarations.section import Section


class ValvesOfRig(Section):
    """Keys of the rig: python-can's interface and channel, or the laboratory's bus."""

    valve_bus: dict[str, Any] | str


class ValvesOfVehicle(Section):
    """Keys of a vehicle: its place on the valve bus."""

    bus_index: int = Field(ge=0, lt=MAX_VEHICLES)
