"""Part ``outside``: programs in any language command a vehicle over Zenoh, under the control lease."""

from groundstation.declarations.node import STATION, Node, NodeRow, Weight
from groundstation.declarations.part import Part
from groundstation.declarations.port import Port, PortRow
from groundstation.declarations.rig import STATION_CHANNEL, Rig
from groundstation.parts.outside.messages import OutsideAnswer, OutsideText, OutsideWrench
from groundstation.parts.outside.outside_desk import OutsideDesk
from groundstation.parts.outside.port import TextsFromOutside


def _desk(rig: Rig, vehicle: str) -> Node:
    del vehicle
    return OutsideDesk(tuple(rig.vehicles))


def _port(rig: Rig, vehicle: str) -> Port:
    del vehicle
    return TextsFromOutside("outside", "", f"{STATION_CHANNEL}hub", tuple(rig.vehicles))


PART = Part(
    name="outside",
    summary="programs in any language command a vehicle over Zenoh, under the control lease",
    topics=(OutsideText, OutsideWrench, OutsideAnswer),
    nodes=(NodeRow("outside_desk", STATION, Weight.LIGHT, OutsideDesk, _desk, is_of_rig=True),),
    ports=(PortRow("outside_desk", TextsFromOutside, _port, is_of_rig=True),),
)
