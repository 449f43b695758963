"""The laboratory's own channel: failures as they begin and end, orders to inject one."""

import json
import math
from collections.abc import Iterable
from dataclasses import dataclass

from drivers.laboratory import FailureEvent, FailureRefused, InjectOrder, encode_order, parse_event
from groundstation.declarations.message import Message
from groundstation.declarations.port import Edge, Port
from groundstation.parts.edges import ByteEdge
from groundstation.parts.laboratory.messages import FailureOrder, InjectedFailure

LINE_BAUD = 115200  # sockets ignore it


class _LineEdge(Edge):
    """JSON lines over TCP; lines that are no event are left out."""

    def __init__(self, url: str) -> None:
        self._bytes = ByteEdge(url, LINE_BAUD)
        self._begun = b""

    def read(self) -> Iterable[tuple[int, object]]:
        for stamp_ns, data in self._bytes.read():
            assert isinstance(data, bytes)
            *lines, self._begun = (self._begun + data).split(b"\n")
            for line in lines:
                try:
                    yield stamp_ns, parse_event(line)
                except ValueError as error:
                    yield stamp_ns, FailureRefused(f"the laboratory's line is not understood: {error}")

    def write(self, data: object) -> None:
        assert isinstance(data, InjectOrder)
        self._bytes.write(encode_order(data))

    def wake(self) -> None:
        self._bytes.wake()

    def close(self) -> None:
        self._bytes.close()


@dataclass(frozen=True)
class LaboratoryPort(Port):
    """Events of the laboratory, and orders to it; one that has no such channel goes without."""

    reads = InjectedFailure
    is_optional = True

    def to_message(self, stamp_ns: int, data: object) -> Message:
        if isinstance(data, FailureRefused):
            return InjectedFailure(stamp_ns, "", "", "{}", False, data.reason)
        assert isinstance(data, FailureEvent)
        plain = {name: value if math.isfinite(value) else None for name, value in data.parameters.items()}
        return InjectedFailure(stamp_ns, data.vehicle, data.kind, json.dumps(plain), data.is_active, "")

    def writes(self) -> tuple[tuple[type[Message], str], ...]:
        return ((FailureOrder, ""),)

    def to_device(self, payload: Message) -> object:
        assert isinstance(payload, FailureOrder)
        return InjectOrder(payload.failure, payload.target, json.loads(payload.parameters), payload.for_s)

    def open(self) -> Edge:
        return _LineEdge(str(self.address))
