"""Part ``overhead``: the camera over the table as second source of fixes, and as referee of the first."""

from drivers.star_camera.exposure import ExposureDelay
from groundstation.declarations.fix import FixSource, Floor
from groundstation.declarations.node import STATION, Node, NodeRow, Weight
from groundstation.declarations.part import Part
from groundstation.declarations.port import Port, PortRow
from groundstation.declarations.rig import Rig, check_address
from groundstation.overhead.liveries import parse_liveries
from groundstation.overhead.overhead_camera import OverheadCamera
from groundstation.parts.overhead.gauges import GAUGES, ComparisonFigure
from groundstation.parts.overhead.messages import FixComparison, OverheadFix, OverheadImage
from groundstation.parts.overhead.port import OverheadCameraPort
from groundstation.parts.overhead.sections import OverheadCameraSection, OverheadOfRig

_TRACKER = "groundstation.parts.overhead.overhead_tracker:OverheadTracker"  # OpenCV loads only where it runs
_REFEREE = "groundstation.parts.overhead.fix_referee:FixReferee"


def _camera(rig: Rig) -> OverheadCameraSection | None:
    return rig.section(OverheadOfRig).overhead_camera


def _has_camera(rig: Rig, vehicle: str) -> bool:
    del vehicle
    return _camera(rig) is not None


def _has_two_sources(rig: Rig, vehicle: str) -> bool:
    return _has_camera(rig, vehicle) and rig.tables.fix_sources["stars"].condition(rig, vehicle)


def _floor(rig: Rig, vehicle: str) -> Floor:
    del vehicle
    camera = _camera(rig)
    assert camera is not None
    return camera.sigma_xy_m, camera.sigma_heading_rad


def _tracker(rig: Rig, vehicle: str) -> Node:
    from groundstation.parts.overhead.overhead_tracker import OverheadTracker  # OpenCV loads only here

    del vehicle
    camera = _camera(rig)
    assert camera is not None
    delay = ExposureDelay(camera.delay_s, camera.delay_sigma_s)
    return OverheadTracker(tuple(rig.vehicles), camera.camera, camera.circles, delay)


def _referee(rig: Rig, vehicle: str) -> Node:
    from groundstation.parts.overhead.fix_referee import FixReferee

    star_floor = rig.tables.fix_sources["stars"].floor(rig, vehicle)
    return FixReferee(vehicle, star_floor, _floor(rig, vehicle))


def _port(rig: Rig, vehicle: str) -> Port | None:
    del vehicle
    camera = _camera(rig)
    if camera is None:
        return None
    return OverheadCameraPort("overhead_camera", "", camera.address, camera.timeout_s)


def _check(rig: Rig) -> None:
    camera = _camera(rig)
    if camera is None:
        return
    check_address(rig, "overhead_camera.address", camera.address)
    camera.camera.value(OverheadCamera.parse)
    dressed = {livery.vehicle for livery in camera.circles.value(parse_liveries)}
    for vehicle in rig.vehicles:
        if vehicle not in dressed:
            raise ValueError(
                f"overhead_camera.circles: {camera.circles.path} has no table [{vehicle}] for the "
                "vehicle of that name"
            )


PART = Part(
    name="overhead",
    summary="pictures of the table from above become fixes; they are compared with star fixes",
    topics=(OverheadImage, OverheadFix, FixComparison),
    nodes=(
        NodeRow(
            "overhead_tracker",
            "overhead",
            Weight.HEAVY,
            _TRACKER,
            _tracker,
            _has_camera,
            is_of_rig=True,
        ),
        NodeRow(
            "fix_referee",
            STATION,
            Weight.LIGHT,
            _REFEREE,
            _referee,
            _has_two_sources,
        ),
    ),
    ports=(PortRow("overhead_tracker", OverheadCameraPort, _port, is_of_rig=True),),
    fix_sources=(FixSource("overhead", OverheadFix, _has_camera, _floor, "an [overhead_camera] section"),),
    rig=OverheadOfRig,
    check=_check,
    gauges=GAUGES,
    figures=(ComparisonFigure,),
)
