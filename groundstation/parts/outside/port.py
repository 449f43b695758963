"""The edge to programs outside the station; virtual time has no such port."""

from collections.abc import Iterable
from dataclasses import dataclass

from groundstation.declarations.message import Message
from groundstation.declarations.port import READ_TIMEOUT_S, Edge, Port
from groundstation.parts.outside.messages import OutsideAnswer, OutsideText


class _OutsideEdge(Edge):
    def __init__(self, endpoint: str, vehicles: tuple[str, ...]) -> None:
        from drivers.outside.port import OutsidePort

        self._port = OutsidePort(endpoint, vehicles)

    def read(self) -> Iterable[tuple[int, object]]:
        return [(arrival.stamp_ns, arrival) for arrival in self._port.read(READ_TIMEOUT_S)]

    def write(self, data: object) -> None:
        assert isinstance(data, OutsideAnswer)
        self._port.send(data.key, data.content)

    def wake(self) -> None:
        self._port.wake()

    def close(self) -> None:
        self._port.close()


@dataclass(frozen=True)
class TextsFromOutside(Port):
    """Texts for all vehicles in, answers out."""

    reads = OutsideText

    vehicles: tuple[str, ...]

    def to_message(self, stamp_ns: int, data: object) -> Message:
        from drivers.outside.port import OutsideArrival

        assert isinstance(data, OutsideArrival)
        return OutsideText(stamp_ns, "", data.key, data.text, data.replaced)

    def writes(self) -> tuple[tuple[type[Message], str], ...]:
        return ((OutsideAnswer, ""),)

    def to_device(self, payload: Message) -> object:
        return payload

    def open(self) -> Edge:
        assert isinstance(self.address, str)
        return _OutsideEdge(self.address, self.vehicles)
