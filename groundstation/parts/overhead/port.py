"""The edge of the overhead tracker: the camera over the table."""

from dataclasses import dataclass

from drivers.laboratory import CameraFrame
from groundstation.declarations.message import Message
from groundstation.declarations.port import Edge, Port
from groundstation.declarations.topic import Delivery
from groundstation.parts.edges import CameraEdge
from groundstation.parts.overhead.messages import OverheadImage


@dataclass(frozen=True)
class OverheadCameraPort(Port):
    """Colour pictures as they arrive, of no vehicle; only the newest counts."""

    reads = OverheadImage
    carries = "camera"
    delivery = Delivery.NEWEST

    timeout_s: float

    def to_message(self, stamp_ns: int, data: object) -> Message:
        assert isinstance(data, CameraFrame)
        height, width, _ = data.image.shape
        device_ns = data.stamp_device_ns or 0
        return OverheadImage(stamp_ns, "", device_ns, height, width, "bgr8", 3 * width, data.image.tobytes())

    def open(self) -> Edge:
        return CameraEdge(str(self.address), self.timeout_s, is_colour=True)
