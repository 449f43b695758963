"""The serial line of the range finder."""

from dataclasses import dataclass

from groundstation.declarations.message import Message
from groundstation.declarations.port import Edge, Port
from groundstation.parts.edges import ByteEdge
from range_finder.messages import RangeBytes


@dataclass(frozen=True)
class RangePort(Port):
    """Bytes that come in; nothing leaves."""

    reads = RangeBytes

    baud: int

    def to_message(self, stamp_ns: int, data: object) -> Message:
        assert isinstance(data, bytes)
        return RangeBytes(stamp_ns, self.vehicle, data)

    def open(self) -> Edge:
        return ByteEdge(str(self.address), self.baud)
