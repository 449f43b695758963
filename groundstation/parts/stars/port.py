"""The edges of the star tracker: its camera, or a stream of poses that stands in for it."""

from dataclasses import dataclass

from groundstation.declarations.message import Message
from groundstation.declarations.port import Edge, Port
from groundstation.parts.edges import STREAM_BAUD, ByteEdge, GreyCameraPort
from groundstation.parts.stars.messages import FixBytes, StarImage


@dataclass(frozen=True)
class StarCameraPort(GreyCameraPort):
    """The camera that looks up."""

    reads = StarImage


@dataclass(frozen=True)
class FixStreamPort(Port):
    """An external pose stream whose poses serve as fixes."""

    reads = FixBytes
    carries = "bytes"

    def to_message(self, stamp_ns: int, data: object) -> Message:
        assert isinstance(data, bytes)
        return FixBytes(stamp_ns, self.vehicle, data)

    def open(self) -> Edge:
        return ByteEdge(str(self.address), STREAM_BAUD)
