"""The model of a rig file, composed of what the parts add to it."""

from functools import cache
from typing import Annotated, Any

from pydantic import Field, create_model

from groundstation.declarations.rig import Rig, VehicleSection, VehicleType
from groundstation.declarations.section import Section
from groundstation.declarations.tables import Tables


@cache
def rig_model(tables: Tables) -> type[Rig]:
    """The class that a rig file of these parts is validated by; keys keep the order of the parts."""
    parts = tables.parts.values()
    vehicle = _joined("Vehicle", VehicleSection, [part.vehicle for part in parts])
    mock_up = _joined("VehicleType", VehicleType, [part.mock_up for part in parts])
    top = _joined("Rig", Rig, [part.rig for part in parts])
    name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]
    fields: dict[str, Any] = {
        "mock_ups": (dict[str, mock_up], ...),  # type: ignore[valid-type]  # made at run time
        "vehicles": (dict[name, vehicle], Field(min_length=1)),  # type: ignore[valid-type]
    }
    composed: type[Rig] = create_model("Rig", __base__=top, **fields)
    composed.tables = tables
    return composed


def _joined(name: str, base: type[Section], added: list[type[Section] | None]) -> type[Any]:
    sections = tuple(section for section in added if section is not None)
    return create_model(name, __base__=(*sections, base))
