"""The whole checkup, in the order in which a person reads it."""

from collections.abc import Callable, Iterator
from itertools import chain

from groundstation.declarations.port import Port
from groundstation.declarations.rig import LABORATORY, STATION_CHANNEL, RecordSection, Rig
from groundstation.declarations.topic import Delivery
from groundstation.launch.checkup import cameras, can_buses, lines, machine
from groundstation.launch.checkup.finding import Finding, Machine, ok
from groundstation.parts.stars.sections import StarsOfType
from groundstation.rig.plan import ports_of
from groundstation.star_tracking.camera_model import CameraCalibration

Looking = Callable[[str], None]
"""Takes what is looked at next, where that takes a while."""


def examine(about: Machine, rig: Rig | None, looking: Looking) -> Iterator[Finding]:
    """Look at a machine, and at the devices that a rig names, or at all that are plugged in.

    Args:
        about: The machine.
        rig: The rig; None for none.
        looking: Told before what takes a while.
    """
    folder = (rig.record if rig is not None else RecordSection()).directory
    yield from chain(
        machine.processors(about),
        machine.urgency(about),
        machine.memory(about),
        machine.power(about),
        machine.disk(folder),
        machine.clocks(about),
    )
    if rig is None:
        yield from _plugged_in(about)
    else:
        for port, _ in ports_of(rig):
            yield from _device(about, rig, port, looking)


def _plugged_in(about: Machine) -> Iterator[Finding]:
    for address in lines.plugged_in(about):
        yield from lines.serial_line(about, "serial line", address)
    yield from cameras.plugged_in(about)
    for name in can_buses.interfaces(about):
        yield from can_buses.can_bus(about, "CAN", name)


def _device(about: Machine, rig: Rig, port: Port, looking: Looking) -> Iterator[Finding]:
    """What a rig opens at a port."""
    address = port.address
    if isinstance(address, dict):
        yield from _bus(about, port.channel, address)
    elif not isinstance(address, str) or address.startswith(STATION_CHANNEL):
        return
    elif address.startswith(LABORATORY):
        yield ok(port.channel, "emulated")
    elif port.delivery is Delivery.NEWEST:
        looking(port.channel)
        yield from cameras.camera(about, port, _calibrated_px(rig, port.vehicle))
    elif address.startswith("/"):
        yield from lines.serial_line(about, port.channel, address)
    else:
        yield ok(port.channel, f"{address} is no device of this machine, and was not looked at")


def _bus(about: Machine, subject: str, settings: dict[str, object]) -> Iterator[Finding]:
    """What python-can is asked for."""
    channel, bitrate = str(settings.get("channel", "")), settings.get("bitrate")
    if settings.get("interface") == "socketcan":
        rate = bitrate if isinstance(bitrate, int) else can_buses.BITRATE
        yield from can_buses.can_bus(about, subject, channel, rate)
    elif channel.startswith("/"):
        yield from lines.serial_line(about, subject, channel.partition("@")[0])
    else:
        shown = ", ".join(f"{name} {value}" for name, value in settings.items())
        yield ok(subject, f"{shown} is no device of this machine, and was not looked at")


def _calibrated_px(rig: Rig, vehicle: str) -> tuple[int, int] | None:
    """Size of the pictures that a star camera was calibrated with."""
    if not vehicle:
        return None
    section = rig.of_type(vehicle, StarsOfType).star_camera
    if section is None:
        return None
    calibration = section.camera.value(CameraCalibration.parse)
    return calibration.width, calibration.height
