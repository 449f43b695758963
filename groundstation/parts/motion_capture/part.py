"""Part ``motion_capture``: poses of a Vicon, OptiTrack, Qualisys or VRPN system as fixes and as reference."""

import math

from groundstation.declarations.fix import FixSource, Floor
from groundstation.declarations.node import Node, NodeRow, Weight
from groundstation.declarations.part import Part
from groundstation.declarations.port import Port, PortRow
from groundstation.declarations.rig import LABORATORY, Rig, check_address
from groundstation.parts.motion_capture.gauges import GAUGES
from groundstation.parts.motion_capture.messages import CapturedPose, CaptureFix
from groundstation.parts.motion_capture.port import CapturePort
from groundstation.parts.motion_capture.sections import (
    CapturedBodySection,
    MotionCaptureOfRig,
    MotionCaptureOfVehicle,
    MotionCaptureSection,
)

_READER = "groundstation.parts.motion_capture.capture_reader:CaptureReader"


def _system(rig: Rig) -> MotionCaptureSection | None:
    return rig.section(MotionCaptureOfRig).motion_capture


def _has_system(rig: Rig, vehicle: str) -> bool:
    del vehicle
    return _system(rig) is not None


def _is_captured(rig: Rig, vehicle: str) -> bool:
    return (
        _has_system(rig, vehicle) and rig.vehicle(vehicle, MotionCaptureOfVehicle).motion_capture is not None
    )


def _floor(rig: Rig, vehicle: str) -> Floor:
    """Its covariance is the rig's already."""
    del rig, vehicle
    return 0.0, 0.0


def _bodies(rig: Rig) -> dict[str, tuple[str, CapturedBodySection]]:
    """Vehicle and section by the name of the rigid body."""
    sections = {name: rig.vehicle(name, MotionCaptureOfVehicle).motion_capture for name in rig.vehicles}
    return {own.body or name: (name, own) for name, own in sections.items() if own is not None}


def _reader(rig: Rig, vehicle: str) -> Node:
    # SciPy loads only where it is used
    from groundstation.parts.motion_capture.capture_frame import CaptureFrame
    from groundstation.parts.motion_capture.capture_reader import CapturedBody, CaptureReader

    del vehicle
    system = _system(rig)
    assert system is not None
    frame = CaptureFrame(system.up, system.origin_table_m, math.radians(system.yaw_deg))
    bodies = {
        body: CapturedBody(name, own.pivot_body_m, math.radians(own.pivot_yaw_deg), own.is_reference)
        for body, (name, own) in _bodies(rig).items()
    }
    return CaptureReader(
        frame,
        bodies,
        system.delay_s,
        system.delay_sigma_s,
        system.sigma_xy_m,
        system.sigma_heading_rad,
        system.up,
    )


def _port(rig: Rig, vehicle: str) -> Port | None:
    del vehicle
    system = _system(rig)
    if system is None:
        return None
    return CapturePort("motion_capture", "", system.address, tuple(_bodies(rig)), system.timeout_s)


def _check(rig: Rig) -> None:
    system = _system(rig)
    for name, vehicle in rig.vehicles.items():
        section = rig.vehicle(name, MotionCaptureOfVehicle).motion_capture
        if section is None:
            continue
        if system is None:
            raise ValueError(f"vehicles.{name}.motion_capture needs a [motion_capture] section")
        if section.is_reference and getattr(vehicle, "reference", None) is not None:
            raise ValueError(
                f"vehicles.{name}.motion_capture.is_reference: the vehicle has another reference already"
            )
    if system is None:
        return
    if isinstance(system.address, str):
        if not system.address.startswith(LABORATORY):
            raise ValueError(
                "motion_capture.address: expected a table with 'system' and 'hostname', "
                f"found {system.address!r}"
            )
        check_address(rig, "motion_capture.address", system.address)
    names = _names(rig)
    for body in names:
        if names.count(body) > 1:
            raise ValueError(f"motion_capture: two vehicles have the body {body!r}")


def _names(rig: Rig) -> list[str]:
    sections = {name: rig.vehicle(name, MotionCaptureOfVehicle).motion_capture for name in rig.vehicles}
    return [section.body or name for name, section in sections.items() if section is not None]


PART = Part(
    name="motion_capture",
    summary="poses of a motion-capture system become fixes, and a reference where there is no other",
    topics=(CapturedPose, CaptureFix),
    nodes=(
        NodeRow(
            "capture_reader",
            "motion_capture",
            Weight.LIGHT,
            _READER,
            _reader,
            _has_system,
            is_of_rig=True,
        ),
    ),
    ports=(PortRow("capture_reader", CapturePort, _port, is_of_rig=True),),
    fix_sources=(
        FixSource(
            "motion_capture", CaptureFix, _is_captured, _floor, "a [motion_capture] section and its body"
        ),
    ),
    rig=MotionCaptureOfRig,
    vehicle=MotionCaptureOfVehicle,
    check=_check,
    gauges=GAUGES,
)
