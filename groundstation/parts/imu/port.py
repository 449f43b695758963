"""The serial line of an IMU block."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

from groundstation.declarations.message import Message
from groundstation.declarations.port import Edge, Port
from groundstation.parts.edges import ByteEdge
from groundstation.parts.imu.messages import ImuBytes, ImuOrder


class _Read(NamedTuple):
    data: bytes
    latency_timer_s: float


class _ImuEdge(ByteEdge):
    """A serial line whose driver may know the adapter's timer."""

    def read(self) -> Iterable[tuple[int, object]]:
        timer_s = self.port.latency_timer_s
        for stamp_ns, data in super().read():
            assert isinstance(data, bytes)
            yield stamp_ns, _Read(data, math.nan if timer_s is None else timer_s)


@dataclass(frozen=True)
class ImuPort(Port):
    """Bytes in both directions; the stamp is the arrival of the last byte of a read."""

    reads = ImuBytes
    carries = "bytes"

    baud: int

    def to_message(self, stamp_ns: int, data: object) -> Message:
        if isinstance(data, _Read):
            return ImuBytes(stamp_ns, self.vehicle, data.data, data.latency_timer_s)
        assert isinstance(data, bytes)
        return ImuBytes(stamp_ns, self.vehicle, data, math.nan)

    def writes(self) -> tuple[tuple[type[Message], str], ...]:
        return ((ImuOrder, self.vehicle),)

    def to_device(self, payload: Message) -> object:
        assert isinstance(payload, ImuOrder)
        return payload.data

    def open(self) -> Edge:
        return _ImuEdge(str(self.address), self.baud)
