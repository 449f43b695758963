"""Every payload of the bus, gathered from the families; one class per topic."""

from groundstation.messages.command import (
    NO_STOP,
    CanIn,
    CanOut,
    ControlStatus,
    ValveCommand,
    ValveDemand,
    ValveSelection,
    ValveStatus,
    Wrench,
)
from groundstation.messages.estimate import (
    FixAccount,
    FusionCalibration,
    FusionStatus,
    ReferenceBytes,
    ReferenceState,
    VehicleState,
)
from groundstation.messages.imu import Imu, ImuBytes, ImuOrder, ImuRaw
from groundstation.messages.operation import (
    Ack,
    CalibrationInUse,
    Diagnostics,
    Journal,
    Latency,
    Request,
    SequencePhase,
    VehicleMode,
)
from groundstation.messages.stars import FixBytes, SkyChange, StarFix, StarImage, StarSpots

__all__ = [
    "NO_STOP",
    "Ack",
    "CalibrationInUse",
    "CanIn",
    "CanOut",
    "ControlStatus",
    "Diagnostics",
    "FixAccount",
    "FixBytes",
    "FusionCalibration",
    "FusionStatus",
    "Imu",
    "ImuBytes",
    "ImuOrder",
    "ImuRaw",
    "Journal",
    "Latency",
    "ReferenceBytes",
    "ReferenceState",
    "Request",
    "SequencePhase",
    "SkyChange",
    "StarFix",
    "StarImage",
    "StarSpots",
    "ValveCommand",
    "ValveDemand",
    "ValveSelection",
    "ValveStatus",
    "VehicleMode",
    "VehicleState",
    "Wrench",
]
