"""Part ``control``: the state becomes the wrench that the vehicle's controller wants."""

import math
from typing import Any

from pydantic import ValidationError

from groundstation.control.controller import Controller
from groundstation.control.controllers import ControllerRow, controllers, make_controller
from groundstation.control.state import Goal
from groundstation.declarations.node import FLIGHT, Node, NodeRow, Weight
from groundstation.declarations.part import Part
from groundstation.declarations.rig import Rig
from groundstation.declarations.validation import message_of
from groundstation.parts.control.actions import GO_TO
from groundstation.parts.control.controller_node import ControllerNode
from groundstation.parts.control.fleet_check import check_corridors, check_holds, check_leaders
from groundstation.parts.control.gauges import GAUGES, StationFigure
from groundstation.parts.control.messages import ControlStatus, Wrench
from groundstation.parts.control.sections import (
    ControlOfType,
    ControlOfVehicle,
    config_of,
    control_of,
)

HOLDING = "go_to"
"""The controller that flies where a program is interrupted."""


def _row(rig: Rig, vehicle: str) -> ControllerRow[Any]:
    return controllers()[control_of(rig, vehicle)[0].controller]


def _process(rig: Rig, vehicle: str) -> str:
    """A controller from another package has a process of its own: if it hangs, the state lives on."""
    return FLIGHT if _row(rig, vehicle).is_built_in else "{vehicle}_controller"


def _controller(rig: Rig, vehicle: str) -> Node:
    return controller_node(rig, vehicle)


def controller_node(rig: Rig, vehicle: str, law: Controller | None = None) -> ControllerNode:
    """The controller of a vehicle.

    Args:
        rig: The rig.
        vehicle: Its name.
        law: A law in place of the rig's: in virtual time, where nodes and caller share a process.
    """
    section, hold = control_of(rig, vehicle)[0], rig.vehicles[vehicle].hold
    row, keep_in = _row(rig, vehicle), rig.table.keep_in()
    config = config_of(rig, vehicle)
    model = rig.type_of(vehicle).model()
    has_program = row.has_program and law is None
    return ControllerNode(
        vehicle,
        law or row.make(config, model, keep_in),
        section.controller if law is None else type(law).__name__,
        Goal((hold.x_m, hold.y_m), math.radians(hold.heading_deg)),
        keep_in,
        tuple(name for name in rig.vehicles if name != vehicle) if law else row.neighbours(config),
        tuple(name for name in rig.vehicles if name != vehicle),
        rig.type_of(vehicle).valves.period_s,
        rig.table.slope_grid(),
        make_controller(HOLDING, {}, model, keep_in) if has_program else None,
        obstacles=rig.table.obstacles(),
        waits=section.waits,
    )


def _check(rig: Rig) -> None:
    for name, type_ in rig.mock_ups.items():
        assert isinstance(type_, ControlOfType)
        _check_name(type_.control.controller, f"mock_ups.{name}.control")
    for name in rig.vehicles:
        section, key = control_of(rig, name)
        _check_name(section.controller, key)
        row = controllers()[section.controller]
        try:
            config = config_of(rig, name)
        except ValidationError as error:
            raise ValueError(f"{key}.parameters{_first(error)}") from error
        for neighbour in row.neighbours(config):
            if neighbour == name or neighbour not in rig.vehicles:
                others = ", ".join(other for other in rig.vehicles if other != name) or "none"
                raise ValueError(
                    f"{key}.parameters: {neighbour!r} is no other vehicle of the rig (there are: {others})"
                )
        try:
            row.make(config, rig.type_of(name).model(), rig.table.keep_in())
        except ValueError as error:
            raise ValueError(f"{key}.parameters: {error}") from error

    check_leaders(rig)
    check_holds(rig)
    check_corridors(rig)


def _check_name(controller: str, key: str) -> None:
    if controller not in controllers():
        known = ", ".join(sorted(controllers()))
        raise ValueError(f"{key}: controller {controller!r} is none of {known}")


def _first(error: ValidationError) -> str:
    first = error.errors()[0]
    where = "".join(f".{step}" for step in first["loc"])  # nowhere: the parameters as a whole
    if not where:
        return f": {message_of(first)}"
    if first["type"] == "extra_forbidden":
        return f"{where}: is no parameter of this controller (a typo?)"
    return f"{where}: {message_of(first)}, found {first['input']!r}"


PART = Part(
    name="control",
    summary="the state becomes the wrench that the controller wants",
    topics=(Wrench, ControlStatus),
    nodes=(NodeRow("controller", _process, Weight.LIGHT, ControllerNode, _controller),),
    actions=(GO_TO,),
    mock_up=ControlOfType,
    vehicle=ControlOfVehicle,
    check=_check,
    gauges=GAUGES,
    figures=(StationFigure,),
)
