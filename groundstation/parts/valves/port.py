"""The CAN bus that all valve nodes share."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from drivers.laboratory import CanFrame
from drivers.valve_bus.frame import BusArrival
from groundstation.declarations.message import Message
from groundstation.declarations.port import READ_TIMEOUT_S, Edge, Port
from groundstation.parts.valves.messages import CanIn, CanOut


class _CanEdge(Edge):
    def __init__(self, config: Mapping[str, object]) -> None:
        from drivers.valve_bus.port import ValveBusPort

        self._bus = ValveBusPort(config)

    def read(self) -> Iterable[tuple[int, object]]:
        return [(arrival.stamp_ns, arrival) for arrival in self._bus.read_newest(READ_TIMEOUT_S)]

    def write(self, data: object) -> None:
        assert isinstance(data, CanFrame)
        self._bus.send(data)

    def close(self) -> None:
        self._bus.close()


@dataclass(frozen=True)
class ValveBus(Port):
    """Frames of all vehicles in both directions."""

    reads = CanIn
    carries = "can"

    vehicles: tuple[str, ...]

    def to_message(self, stamp_ns: int, data: object) -> Message:
        if isinstance(data, BusArrival):
            return CanIn(stamp_ns, "", data.frame.arbitration_id, data.frame.data, data.passed)
        assert isinstance(data, CanFrame)
        return CanIn(stamp_ns, "", data.arbitration_id, data.data, 1)

    def writes(self) -> tuple[tuple[type[Message], str], ...]:
        return tuple((CanOut, vehicle) for vehicle in self.vehicles)

    def to_device(self, payload: Message) -> object:
        assert isinstance(payload, CanOut)
        return CanFrame(payload.arbitration_id, payload.data)

    def open(self) -> Edge:
        assert isinstance(self.address, Mapping)
        return _CanEdge(self.address)
