"""Part ``operation``: how a rig is run: requests, recorder, health, calibrations in use, latency."""

from groundstation.declarations.part import Part
from groundstation.declarations.request import Ack, Request
from groundstation.parts.operation.messages import CalibrationInUse, Diagnostics, Latency, RecorderStatus

PART = Part(
    name="operation",
    summary="requests and answers, recorder, health and latency",
    topics=(Request, Ack, RecorderStatus, CalibrationInUse, Diagnostics, Latency),
)
