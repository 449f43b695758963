"""Part ``relative_navigation``: pictures of another mock-up become its distance, bearing and attitude."""

from drivers.star_camera.exposure import ExposureDelay
from groundstation.declarations.node import FLIGHT, Node, NodeRow, Weight
from groundstation.declarations.part import Part
from groundstation.declarations.port import Port, PortRow
from groundstation.declarations.rig import Rig, check_address
from groundstation.parts.relative_navigation.gauges import GAUGES, SightingFigure
from groundstation.parts.relative_navigation.leader_filter import LeaderFilter
from groundstation.parts.relative_navigation.messages import LeaderState, RelativePose, SideImage
from groundstation.parts.relative_navigation.port import SideCameraPort
from groundstation.parts.relative_navigation.sections import (
    RelativeNavigationOfType,
    RelativeNavigationOfVehicle,
    SideCameraOfVehicleSection,
    SideCameraSection,
)
from groundstation.relative_navigation.rivals import rivals_of
from groundstation.relative_navigation.side_bodies import SideBody, parse_side_bodies
from groundstation.relative_navigation.side_camera import SideCamera

_FINDER = "groundstation.parts.relative_navigation.side_finder:SideFinder"  # OpenCV loads only where it runs
SIDE = "{vehicle}_side"
"""The process that looks at the side camera's pictures."""


def _own(rig: Rig, vehicle: str) -> SideCameraOfVehicleSection | None:
    return rig.vehicle(vehicle, RelativeNavigationOfVehicle).side_camera


def _has_camera(rig: Rig, vehicle: str) -> bool:
    return _own(rig, vehicle) is not None


def _camera(rig: Rig, vehicle: str) -> SideCameraSection:
    camera = rig.of_type(vehicle, RelativeNavigationOfType).side_camera
    assert camera is not None
    return camera


def _body(rig: Rig, vehicle: str) -> SideBody:
    """Whom a vehicle's camera looks for.

    Raises:
        ValueError: The file of bodies does not know it.
    """
    own, path = _own(rig, vehicle), _camera(rig, vehicle).bodies.path
    assert own is not None
    for body in _camera(rig, vehicle).bodies.value(parse_side_bodies):
        if body.vehicle == own.looks_for:
            return body
    raise ValueError(f"{path} has no table [{own.looks_for}] for the vehicle of that name")


def _rivals(rig: Rig, vehicle: str) -> dict[str, float]:
    """Other vehicles that may be taken for whom a vehicle's camera looks for; how near they come (m)."""
    own, body = _own(rig, vehicle), _body(rig, vehicle)
    assert own is not None
    known = {other.vehicle: other for other in _camera(rig, vehicle).bodies.value(parse_side_bodies)}
    others = {name: known.get(name) for name in rig.vehicles if name not in (vehicle, own.looks_for)}
    return rivals_of(body, others, own.by)


def _finder(rig: Rig, vehicle: str) -> Node:
    from groundstation.parts.relative_navigation.side_finder import SideFinder  # OpenCV loads only here

    own, section = _own(rig, vehicle), _camera(rig, vehicle)
    assert own is not None
    return SideFinder(
        vehicle,
        section.camera.value(SideCamera.parse),
        _body(rig, vehicle),
        own.by,
        (section.camera, section.bodies),
        ExposureDelay(section.delay_s, section.delay_sigma_s),
        (section.sigma_xy_m, section.sigma_heading_rad),
        _rivals(rig, vehicle),
    )


def _leader_filter(rig: Rig, vehicle: str) -> Node:
    own = _own(rig, vehicle)
    assert own is not None
    return LeaderFilter(vehicle, own.looks_for)


def _port(rig: Rig, vehicle: str) -> Port | None:
    own = _own(rig, vehicle)
    if own is None:
        return None
    return SideCameraPort(f"{vehicle}/side_camera", vehicle, own.address, _camera(rig, vehicle).timeout_s)


def _check(rig: Rig) -> None:
    for name, vehicle in rig.vehicles.items():
        own, key = _own(rig, name), f"vehicles.{name}.side_camera"
        if own is None:
            if rig.vehicle(name, RelativeNavigationOfVehicle).leader_by == "side_camera":
                raise ValueError(f"vehicles.{name}.leader_by: it has no side_camera to know its leader by")
            continue
        if rig.of_type(name, RelativeNavigationOfType).side_camera is None:
            raise ValueError(f"{key}: an address without mock_ups.{vehicle.mock_up}.side_camera")
        check_address(rig, f"{key}.address", own.address)
        if own.looks_for == name or own.looks_for not in rig.vehicles:
            others = ", ".join(other for other in rig.vehicles if other != name) or "none"
            raise ValueError(f"{key}.looks_for: {own.looks_for!r} is no other vehicle (there are: {others})")
        camera, body = _camera(rig, name).camera.value(SideCamera.parse), _body(rig, name)
        try:
            body.check_seen_from(camera.position_body_m[2])
        except ValueError as error:
            raise ValueError(f"{key}: {error}") from error
        if own.by == "markers" and not body.azimuths_rad:
            raise ValueError(f"{key}.by: {body.vehicle} has no markers in {_camera(rig, name).bodies.path}")


PART = Part(
    name="relative_navigation",
    summary="pictures of another mock-up become its place and attitude, by which a follower may fly",
    topics=(SideImage, RelativePose, LeaderState),
    nodes=(
        NodeRow("side_finder", SIDE, Weight.HEAVY, _FINDER, _finder, _has_camera),
        NodeRow("leader_filter", FLIGHT, Weight.LIGHT, LeaderFilter, _leader_filter, _has_camera),
    ),
    ports=(PortRow("side_finder", SideCameraPort, _port),),
    mock_up=RelativeNavigationOfType,
    vehicle=RelativeNavigationOfVehicle,
    check=_check,
    gauges=GAUGES,
    figures=(SightingFigure,),
)
