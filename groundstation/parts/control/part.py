"""Part ``control``: the state becomes the wrench that the vehicle's controller wants."""

import math

from groundstation.control.controller import Controller
from groundstation.control.state import Goal
from groundstation.declarations.node import FLIGHT, Node, NodeRow, Weight
from groundstation.declarations.part import Part
from groundstation.declarations.rig import Rig
from groundstation.parts.control.actions import CHANGE_CONTROLLER, GO_TO
from groundstation.parts.control.controller_node import ControllerNode
from groundstation.parts.control.fleet_check import check_corridors, check_holds, check_leaders
from groundstation.parts.control.gauges import GAUGES, StationFigure
from groundstation.parts.control.laws import Law, check_name, law_of, maker_of, row_of
from groundstation.parts.control.messages import ControlStatus, Wrench
from groundstation.parts.control.sections import ControlOfType, ControlOfVehicle, control_of
from groundstation.parts.relative_navigation.sections import RelativeNavigationOfVehicle


def _process(rig: Rig, vehicle: str) -> str:
    """A controller from another package has a process of its own: if it hangs, the state lives on."""
    return FLIGHT if row_of(rig, vehicle).is_built_in else "{vehicle}_controller"


def _controller(rig: Rig, vehicle: str) -> Node:
    return controller_node(rig, vehicle)


def controller_node(rig: Rig, vehicle: str, law: Controller | None = None) -> ControllerNode:
    """The controller of a vehicle.

    Args:
        rig: The rig.
        vehicle: Its name.
        law: A law in place of the rig's: in virtual time, where nodes and caller share a process.
    """
    section, key = control_of(rig, vehicle)
    hold = rig.vehicles[vehicle].hold
    others = tuple(name for name in rig.vehicles if name != vehicle)
    given = None if law is None else Law(type(law).__name__, law, neighbours=others)
    return ControllerNode(
        vehicle,
        given or law_of(rig, vehicle, section, key),
        Goal((hold.x_m, hold.y_m), math.radians(hold.heading_deg)),
        rig.table.keep_in(),
        others,
        rig.type_of(vehicle).valves.period_s,
        rig.table.slope_grid(),
        maker_of(rig, vehicle) if given is None else None,
        obstacles=rig.table.obstacles(),
        waits=section.waits,
        sees=rig.vehicle(vehicle, RelativeNavigationOfVehicle).leader_seen(),
    )


def _check(rig: Rig) -> None:
    for name, type_ in rig.mock_ups.items():
        assert isinstance(type_, ControlOfType)
        check_name(type_.control.controller, f"mock_ups.{name}.control")
    for name in rig.vehicles:
        law = law_of(rig, name, *control_of(rig, name))
        seen = rig.vehicle(name, RelativeNavigationOfVehicle).leader_seen()
        if seen and seen not in law.neighbours:
            raise ValueError(
                f"vehicles.{name}.leader_by: its side camera looks for {seen}, whom its controller does not "
                "follow"
            )
    check_leaders(rig)
    check_holds(rig)
    check_corridors(rig)


PART = Part(
    name="control",
    summary="the state becomes the wrench that the controller wants",
    topics=(Wrench, ControlStatus),
    nodes=(NodeRow("controller", _process, Weight.LIGHT, ControllerNode, _controller),),
    actions=(GO_TO, CHANGE_CONTROLLER),
    mock_up=ControlOfType,
    vehicle=ControlOfVehicle,
    check=_check,
    gauges=GAUGES,
    figures=(StationFigure,),
)
