"""Part ``operation``: how a rig is run: requests, start sequence, health, calibrations in use, latency."""

from groundstation.declarations.node import STATION, Node, NodeRow, Weight
from groundstation.declarations.part import Part
from groundstation.declarations.request import Ack, Request
from groundstation.declarations.rig import Rig
from groundstation.declarations.section import Section
from groundstation.parts.fusion.sections import FusionOfType
from groundstation.parts.operation.gauges import GAUGES
from groundstation.parts.operation.messages import CalibrationInUse, Diagnostics, Latency, SequencePhase
from groundstation.parts.operation.start_sequence import StartSequence


class OperationOfVehicle(Section):
    """Keys of a vehicle."""

    starts_by_itself: bool = True


def _starts_by_itself(rig: Rig, vehicle: str) -> bool:
    return rig.vehicle(vehicle, OperationOfVehicle).starts_by_itself


def _start_sequence(rig: Rig, vehicle: str) -> Node:
    return StartSequence(vehicle, rig.of_type(vehicle, FusionOfType).fusion.rest_s)


_START = NodeRow("start_sequence", STATION, Weight.LIGHT, StartSequence, _start_sequence, _starts_by_itself)
PART = Part(
    name="operation",
    summary="requests and answers, the start sequence, health and latency",
    topics=(Request, Ack, SequencePhase, CalibrationInUse, Diagnostics, Latency),
    nodes=(_START,),
    vehicle=OperationOfVehicle,
    gauges=GAUGES,
)
