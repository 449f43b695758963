"""The edges of the star tracker: its camera, or a stream of poses that stands in for it."""

from dataclasses import dataclass

from drivers.laboratory import CameraFrame
from groundstation.declarations.message import Message
from groundstation.declarations.port import Edge, Port
from groundstation.declarations.topic import Delivery
from groundstation.parts.edges import STREAM_BAUD, ByteEdge, CameraEdge
from groundstation.parts.stars.messages import FixBytes, StarImage


@dataclass(frozen=True)
class StarCameraPort(Port):
    """Grey pictures as they arrive; only the newest counts."""

    reads = StarImage
    delivery = Delivery.NEWEST

    timeout_s: float

    def to_message(self, stamp_ns: int, data: object) -> Message:
        assert isinstance(data, CameraFrame)
        height, width = data.image.shape
        device_ns = data.stamp_device_ns or 0
        return StarImage(
            stamp_ns, self.vehicle, device_ns, height, width, "mono8", width, data.image.tobytes()
        )

    def open(self) -> Edge:
        return CameraEdge(str(self.address), self.timeout_s)


@dataclass(frozen=True)
class FixStreamPort(Port):
    """An external pose stream whose poses serve as fixes."""

    reads = FixBytes

    def to_message(self, stamp_ns: int, data: object) -> Message:
        assert isinstance(data, bytes)
        return FixBytes(stamp_ns, self.vehicle, data)

    def open(self) -> Edge:
        return ByteEdge(str(self.address), STREAM_BAUD)
