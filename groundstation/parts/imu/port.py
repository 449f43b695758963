"""The serial line of an IMU block."""

from dataclasses import dataclass

from groundstation.declarations.message import Message
from groundstation.declarations.port import Edge, Port
from groundstation.parts.edges import ByteEdge
from groundstation.parts.imu.messages import ImuBytes, ImuOrder


@dataclass(frozen=True)
class ImuPort(Port):
    """Bytes in both directions; the stamp is the arrival of the last byte of a read."""

    reads = ImuBytes

    baud: int

    def to_message(self, stamp_ns: int, data: object) -> Message:
        assert isinstance(data, bytes)
        return ImuBytes(stamp_ns, self.vehicle, data)

    def writes(self) -> tuple[tuple[type[Message], str], ...]:
        return ((ImuOrder, self.vehicle),)

    def to_device(self, payload: Message) -> object:
        assert isinstance(payload, ImuOrder)
        return payload.data

    def open(self) -> Edge:
        return ByteEdge(str(self.address), self.baud)
