"""Part ``reference``: truth of the emulator, or a stream of motion capture, for those who observe."""

from dataclasses import dataclass

from groundstation.declarations.message import Message
from groundstation.declarations.node import STATION, Node, NodeRow, Weight
from groundstation.declarations.part import Part
from groundstation.declarations.port import Edge, Port, PortRow
from groundstation.declarations.rig import Rig, check_address
from groundstation.declarations.section import Section
from groundstation.parts.edges import STREAM_BAUD, ByteEdge
from groundstation.parts.reference.gauges import GAUGES, EstimateFigure
from groundstation.parts.reference.messages import ReferenceBytes, ReferenceState
from groundstation.parts.reference.reference_reader import ReferenceReader


class ReferenceOfVehicle(Section):
    """Keys of a vehicle: where its reference stream is opened."""

    reference: str | None = None


@dataclass(frozen=True)
class ReferencePort(Port):
    """A stream of poses."""

    reads = ReferenceBytes
    carries = "bytes"

    def to_message(self, stamp_ns: int, data: object) -> Message:
        assert isinstance(data, bytes)
        return ReferenceBytes(stamp_ns, self.vehicle, data)

    def open(self) -> Edge:
        return ByteEdge(str(self.address), STREAM_BAUD)


def _has_reference(rig: Rig, vehicle: str) -> bool:
    return rig.vehicle(vehicle, ReferenceOfVehicle).reference is not None


def _reader(rig: Rig, vehicle: str) -> Node:
    del rig
    return ReferenceReader(vehicle)


def _port(rig: Rig, vehicle: str) -> Port | None:
    address = rig.vehicle(vehicle, ReferenceOfVehicle).reference
    return None if address is None else ReferencePort(f"{vehicle}/reference", vehicle, address)


def _check(rig: Rig) -> None:
    for name in rig.vehicles:
        check_address(rig, f"vehicles.{name}.reference", rig.vehicle(name, ReferenceOfVehicle).reference)


PART = Part(
    name="reference",
    summary="poses of a reference system, for view, recorder and report",
    topics=(ReferenceBytes, ReferenceState),
    nodes=(NodeRow("reference_reader", STATION, Weight.LIGHT, ReferenceReader, _reader, _has_reference),),
    ports=(PortRow("reference_reader", ReferencePort, _port),),
    vehicle=ReferenceOfVehicle,
    check=_check,
    gauges=GAUGES,
    figures=(EstimateFigure,),
)
