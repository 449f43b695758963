"""The edge of relative navigation: the camera on the hull, read by the same driver as a star camera."""

from dataclasses import dataclass

from drivers.laboratory import CameraFrame
from groundstation.declarations.message import Message
from groundstation.declarations.port import Edge, Port
from groundstation.declarations.topic import Delivery
from groundstation.parts.edges import CameraEdge
from groundstation.parts.relative_navigation.messages import SideImage


@dataclass(frozen=True)
class SideCameraPort(Port):
    """Grey pictures as they arrive; only the newest counts."""

    reads = SideImage
    delivery = Delivery.NEWEST

    timeout_s: float

    def to_message(self, stamp_ns: int, data: object) -> Message:
        assert isinstance(data, CameraFrame)
        height, width = data.image.shape
        device_ns = data.stamp_device_ns or 0
        return SideImage(
            stamp_ns, self.vehicle, device_ns, height, width, "mono8", width, data.image.tobytes()
        )

    def open(self) -> Edge:
        return CameraEdge(str(self.address), self.timeout_s)
