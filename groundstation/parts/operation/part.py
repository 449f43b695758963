"""Part ``operation``: how a rig is run: requests, control lease, recorder, health, calibrations, latency."""

from groundstation.declarations.lease import Lease
from groundstation.declarations.node import STATION, Node, NodeRow, Weight
from groundstation.declarations.part import Part
from groundstation.declarations.port import Port, PortRow
from groundstation.declarations.request import Ack, Request
from groundstation.declarations.rig import STATION_CHANNEL, Rig
from groundstation.parts.operation.lease_desk import ACTIONS, LeaseDesk
from groundstation.parts.operation.lease_memory import LeasePort
from groundstation.parts.operation.messages import (
    CalibrationInUse,
    Diagnostics,
    KeptLease,
    Latency,
    RecorderStatus,
)


def _lease_desk(rig: Rig, vehicle: str) -> Node:
    del vehicle
    return LeaseDesk(tuple(rig.vehicles))


def _lease_port(rig: Rig, vehicle: str) -> Port:
    del rig, vehicle
    return LeasePort("lease", "", f"{STATION_CHANNEL}memory")


PART = Part(
    name="operation",
    summary="requests and answers, control lease, recorder, health and latency",
    topics=(Request, Ack, Lease, KeptLease, RecorderStatus, CalibrationInUse, Diagnostics, Latency),
    nodes=(NodeRow("lease_desk", STATION, Weight.LIGHT, LeaseDesk, _lease_desk, is_of_rig=True),),
    ports=(PortRow("lease_desk", LeasePort, _lease_port, is_of_rig=True),),
    actions=tuple(ACTIONS.values()),
)
