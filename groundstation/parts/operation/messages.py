"""How a rig is run: recorder, calibrations in use, health, latency."""

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar

from groundstation.declarations.message import (
    F64,
    PACKAGE,
    U8,
    U64,
    Float64Sequence,
    Message,
    Text,
    TextSequence,
)
from groundstation.declarations.rig_file import RigFile
from groundstation.declarations.topic import Rank, Scope, Topic


@dataclass(frozen=True, slots=True, eq=False)
class RecorderStatus(Message):
    """The recorder is alive, and how long it can go on; twice a second where a rig is recorded.

    Attributes:
        path: Of the recording.
        written_bytes: So far.
        free_bytes: On its disk.
        room_s: How long that is enough at the rate so far.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/RecorderStatus"
    TOPIC: ClassVar = Topic("recorder_status", 2, scope=Scope.RIG)
    path: Text
    written_bytes: U64
    free_bytes: U64
    room_s: F64


@dataclass(frozen=True, slots=True, eq=False)
class KeptLease(Message):
    """What was kept on disk of the control lease, at the start of the process.

    Attributes:
        content: JSON object; empty where nothing was kept.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/KeptLease"
    TOPIC: ClassVar = Topic("kept_lease", rank=Rank.REQUEST, scope=Scope.RIG)
    content: Text


@dataclass(frozen=True, slots=True, eq=False)
class CalibrationInUse(Message):
    """A calibration file as loaded, with its hash; latched."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/CalibrationInUse"
    TOPIC: ClassVar = Topic("calibration", latched=True)
    name: Text
    sha256: Text
    content: Text

    @classmethod
    def of(cls, now_ns: int, vehicle: str, files: Iterable[RigFile]) -> "CalibrationInUse":
        """What is published of the files that a node has loaded, as one."""
        loaded = tuple(files)
        content = [file.text() for file in loaded]
        digest = hashlib.sha256("".join(content).encode()).hexdigest()
        return cls(now_ns, vehicle, " ".join(file.path.name for file in loaded), digest, "\n".join(content))


@dataclass(frozen=True, slots=True, eq=False)
class Diagnostics(Message):
    """Counters and health of one node, once a second."""

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/Diagnostics"
    TOPIC: ClassVar = Topic("diagnostics", 1, scope=Scope.PROCESS)
    node: Text
    level: U8
    summary: Text
    keys: TextSequence
    values: TextSequence


@dataclass(frozen=True, slots=True, eq=False)
class Latency(Message):
    """Ages along the chain from light to valve, per vehicle, over the last seconds.

    Attributes:
        stages: Names, in the order of the chain.
        p50_s: Median age per stage.
        p99_s: 99th percentile per stage.
    """

    ROS_TYPE: ClassVar[str] = f"{PACKAGE}/msg/Latency"
    TOPIC: ClassVar = Topic("latency", 1, observers_only=True)
    stages: TextSequence
    p50_s: Float64Sequence
    p99_s: Float64Sequence
