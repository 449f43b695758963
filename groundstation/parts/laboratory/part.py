"""Part ``laboratory``: failures that the emulated laboratory injects are messages, and can be asked for."""

from groundstation.declarations.node import STATION, Node, NodeRow, Weight
from groundstation.declarations.part import Part
from groundstation.declarations.port import Port, PortRow
from groundstation.declarations.rig import LABORATORY, Rig
from groundstation.parts.laboratory.failure_desk import INJECT, FailureDesk
from groundstation.parts.laboratory.gauges import GAUGES
from groundstation.parts.laboratory.messages import FailureOrder, InjectedFailure
from groundstation.parts.laboratory.port import LaboratoryPort

CHANNEL = "laboratory"


def _is_emulated(rig: Rig, vehicle: str) -> bool:
    del vehicle
    return rig.laboratory is not None


def _desk(rig: Rig, vehicle: str) -> Node:
    del vehicle
    return FailureDesk(tuple(rig.vehicles))


def _port(rig: Rig, vehicle: str) -> Port | None:
    return LaboratoryPort(CHANNEL, "", LABORATORY + CHANNEL) if _is_emulated(rig, vehicle) else None


PART = Part(
    name="laboratory",
    summary="failures that the emulated laboratory injects, on the bus and on request",
    topics=(InjectedFailure, FailureOrder),
    nodes=(NodeRow("failure_desk", STATION, Weight.LIGHT, FailureDesk, _desk, _is_emulated, is_of_rig=True),),
    ports=(PortRow("failure_desk", LaboratoryPort, _port, is_of_rig=True),),
    actions=(INJECT,),
    gauges=GAUGES,
)
