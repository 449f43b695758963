"""Part ``range_finder``: lines of a laser range finder become distances."""

from groundstation.declarations.node import Node, NodeRow, Weight
from groundstation.declarations.part import Part
from groundstation.declarations.port import Port, PortRow
from groundstation.declarations.rig import Rig, check_address
from range_finder.gauges import GAUGES
from range_finder.messages import Range, RangeBytes
from range_finder.port import RangePort
from range_finder.range_reader import RangeReader
from range_finder.sections import RangeFinderOfType, RangeFinderOfVehicle

PROCESS = "{vehicle}_range_finder"  # of its own: whatever happens in it, the flight goes on


def _address(rig: Rig, vehicle: str) -> str | None:
    return rig.vehicle(vehicle, RangeFinderOfVehicle).range_finder


def _has_one(rig: Rig, vehicle: str) -> bool:
    return _address(rig, vehicle) is not None


def _reader(rig: Rig, vehicle: str) -> Node:
    section = rig.of_type(vehicle, RangeFinderOfType).range_finder
    return RangeReader(vehicle, section.sigma_m, section.delay_s)


def _port(rig: Rig, vehicle: str) -> Port | None:
    address = _address(rig, vehicle)
    baud = rig.of_type(vehicle, RangeFinderOfType).range_finder.baud
    return None if address is None else RangePort(f"{vehicle}/range_finder", vehicle, address, baud)


def _check(rig: Rig) -> None:
    for name in rig.vehicles:
        check_address(rig, f"vehicles.{name}.range_finder", _address(rig, name))


PART = Part(
    name="range_finder",
    summary="lines of a laser range finder become distances",
    topics=(RangeBytes, Range),
    nodes=(NodeRow("range_reader", PROCESS, Weight.LIGHT, RangeReader, _reader, _has_one),),
    ports=(PortRow("range_reader", RangePort, _port),),
    mock_up=RangeFinderOfType,
    vehicle=RangeFinderOfVehicle,
    check=_check,
    gauges=GAUGES,
)
