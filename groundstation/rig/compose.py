"""The model of a rig file, composed of what the parts add to it."""

from collections.abc import Mapping
from functools import cache
from typing import Any

from pydantic import Field, create_model

from groundstation.declarations.errors import UsageError
from groundstation.declarations.rig import Rig, VehicleName, VehicleSection
from groundstation.declarations.section import Section
from groundstation.declarations.tables import Tables
from groundstation.declarations.vehicle_type import VehicleType

_PLACES: Mapping[type[Section], str] = {
    VehicleSection: "a vehicle",
    VehicleType: "a type of mock-up",
    Rig: "the rig",
}


@cache
def rig_model(tables: Tables) -> type[Rig]:
    """The class that a rig file of these parts is validated by; keys keep the order of the parts.

    Raises:
        UsageError: Two parts add the same key.
    """
    parts = tables.parts.values()
    vehicle = _joined("Vehicle", VehicleSection, {part.name: part.vehicle for part in parts})
    mock_up = _joined("VehicleType", VehicleType, {part.name: part.mock_up for part in parts})
    top = _joined("Rig", Rig, {part.name: part.rig for part in parts})
    fields: dict[str, Any] = {
        "mock_ups": (dict[str, mock_up], ...),  # type: ignore[valid-type]  # made at run time
        "vehicles": (dict[VehicleName, vehicle], Field(min_length=1)),  # type: ignore[valid-type]
    }
    composed: type[Rig] = create_model("Rig", __base__=top, **fields)
    composed.tables = tables
    return composed


def _joined(name: str, base: type[Section], added: Mapping[str, type[Section] | None]) -> type[Any]:
    owners = dict.fromkeys(base.model_fields, "the rig itself")
    sections = {part: section for part, section in added.items() if section is not None}
    for part, section in sections.items():
        for key in section.model_fields:
            if key in owners:
                place = _PLACES[base]
                raise UsageError(
                    f"the part {part!r} adds a key {key!r} to {place}, which is taken by {owners[key]}"
                )
            owners[key] = f"the part {part!r}"
    return create_model(name, __base__=(*sections.values(), base))
