"""Part ``imu``: bytes of the IMU block become calibrated samples."""

import math

from groundstation.declarations.node import FLIGHT, Node, NodeRow, Weight
from groundstation.declarations.part import Part
from groundstation.declarations.port import Port, PortRow
from groundstation.declarations.rig import Rig, check_address
from groundstation.parts.imu.gauges import GAUGES, ImuFigure
from groundstation.parts.imu.imu_reader import ImuReader
from groundstation.parts.imu.messages import Imu, ImuBytes, ImuOrder, ImuRaw
from groundstation.parts.imu.port import ImuPort
from groundstation.parts.imu.sections import ImuOfType, ImuOfVehicle


def _reader(rig: Rig, vehicle: str) -> Node:
    imu = rig.of_type(vehicle, ImuOfType).imu
    serial_number = rig.vehicle(vehicle, ImuOfVehicle).imu_serial_number
    given_c = math.nan if imu.temperature_c is None else imu.temperature_c
    return ImuReader(
        vehicle, imu.protocol, imu.baud, imu.ftdi_latency_s, imu.averaging, serial_number, given_c
    )


def _port(rig: Rig, vehicle: str) -> Port:
    baud = rig.of_type(vehicle, ImuOfType).imu.baud
    return ImuPort(f"{vehicle}/imu", vehicle, rig.vehicle(vehicle, ImuOfVehicle).imu, baud)


def _check(rig: Rig) -> None:
    owners: dict[str, str] = {}
    for name in rig.vehicles:
        address = rig.vehicle(name, ImuOfVehicle).imu
        if address in owners:
            raise ValueError(f"vehicles.{name}.imu: {address!r} is already that of {owners[address]}")
        owners[address] = name
        check_address(rig, f"vehicles.{name}.imu", address)


PART = Part(
    name="imu",
    summary="bytes of the IMU block become samples in SI units",
    topics=(ImuBytes, ImuRaw, Imu, ImuOrder),
    nodes=(NodeRow("imu_reader", FLIGHT, Weight.URGENT, ImuReader, _reader),),
    ports=(PortRow("imu_reader", ImuPort, _port),),
    mock_up=ImuOfType,
    vehicle=ImuOfVehicle,
    check=_check,
    gauges=GAUGES,
    figures=(ImuFigure,),
)
