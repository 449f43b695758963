"""The edge of motion capture: the library's own sockets, poses as they arrive."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from drivers.motion_capture.pose import MotionCapturePose
from groundstation.declarations.message import Message
from groundstation.declarations.port import READ_TIMEOUT_S, Edge, Port
from groundstation.parts.motion_capture.messages import CapturedPose


class _CaptureEdge(Edge):
    def __init__(self, config: Mapping[str, object], bodies: tuple[str, ...], timeout_s: float) -> None:
        from drivers.motion_capture.port import MotionCapturePort

        self._capture = MotionCapturePort(config, bodies, silence_s=timeout_s)

    def read(self) -> Iterable[tuple[int, object]]:
        found = self._capture.read(READ_TIMEOUT_S)
        return () if found is None else (found,)

    def close(self) -> None:
        self._capture.close()


@dataclass(frozen=True)
class CapturePort(Port):
    """Poses of the rigid bodies of all vehicles."""

    reads = CapturedPose
    carries = "poses"

    bodies: tuple[str, ...]
    timeout_s: float

    def to_message(self, stamp_ns: int, data: object) -> Message:
        assert isinstance(data, MotionCapturePose)
        return CapturedPose(
            stamp_ns, "", data.name, data.frame, data.position_m, data.quaternion_xyzw, data.is_tracked
        )

    def open(self) -> Edge:
        assert isinstance(self.address, Mapping)
        return _CaptureEdge(self.address, self.bodies, self.timeout_s)
