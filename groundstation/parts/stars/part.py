"""Part ``stars``: pictures of the ceiling become fixes."""

import math

from drivers.star_camera.exposure import ExposureDelay
from groundstation.declarations.fix import FixSource, Floor
from groundstation.declarations.node import FLIGHT, SKY, Node, NodeRow, Weight
from groundstation.declarations.part import Part
from groundstation.declarations.port import Port, PortRow
from groundstation.declarations.rig import Rig, check_address
from groundstation.parts.imu.sections import ImuOfType
from groundstation.parts.stars.actions import PICTURE
from groundstation.parts.stars.fix_reader import FixReader
from groundstation.parts.stars.gauges import GAUGES
from groundstation.parts.stars.messages import (
    FixBytes,
    PictureTrouble,
    SkyChange,
    StarFix,
    StarImage,
    StarMatches,
    StarPicture,
    StarSpots,
)
from groundstation.parts.stars.port import FixStreamPort, StarCameraPort
from groundstation.parts.stars.sections import StarCameraSection, StarsOfType, StarsOfVehicle
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.identifications import IMAGES
from groundstation.star_tracking.star_catalogue import StarCatalogue

LINK_SIGMA_S = 0.001
"""What a link takes beyond the age that a pose states, where the rig says nothing of it."""
# OpenCV loads only where these run
_CHECK = "groundstation.parts.stars.picture_check:PictureCheck"
_SPOTS = "groundstation.parts.stars.spot_finder:SpotFinder"
_TRACKER = "groundstation.parts.stars.star_tracker:StarTracker"
_KEEPER = "groundstation.parts.stars.picture_keeper:PictureKeeper"


def _has_camera(rig: Rig, vehicle: str) -> bool:
    return rig.vehicle(vehicle, StarsOfVehicle).star_camera is not None


def _has_stream(rig: Rig, vehicle: str) -> bool:
    return rig.vehicle(vehicle, StarsOfVehicle).fixes is not None


def _has_stars(rig: Rig, vehicle: str) -> bool:
    return rig.vehicle(vehicle, StarsOfVehicle).has_stars


def _camera(rig: Rig, vehicle: str) -> StarCameraSection:
    camera = rig.of_type(vehicle, StarsOfType).star_camera
    assert camera is not None
    return camera


def _floor(rig: Rig, vehicle: str) -> Floor:
    """An external pose stream states its errors itself."""
    camera = rig.of_type(vehicle, StarsOfType).star_camera
    if _has_stream(rig, vehicle) or camera is None:
        return 0.0, 0.0
    return camera.sigma_xy_m, camera.sigma_heading_rad


def _fix_reader(rig: Rig, vehicle: str) -> Node:
    camera = rig.of_type(vehicle, StarsOfType).star_camera
    stamp_sigma_s = camera.delay[1] if camera is not None else LINK_SIGMA_S
    return FixReader(vehicle, stamp_sigma_s, rig.of_type(vehicle, ImuOfType).imu.usual_spread_s)


def _picture_check(rig: Rig, vehicle: str) -> Node:
    from groundstation.parts.stars.picture_check import PictureCheck

    del rig
    return PictureCheck(vehicle)


def _spot_finder(rig: Rig, vehicle: str) -> Node:
    from groundstation.parts.stars.spot_finder import SpotFinder  # OpenCV loads only where it is used

    camera = _camera(rig, vehicle)
    lens = camera.camera.value(CameraCalibration.parse)
    return SpotFinder(vehicle, (lens.width, lens.height), IMAGES[camera.image](camera.sky_settings))


def _star_tracker(rig: Rig, vehicle: str) -> Node:
    from groundstation.parts.stars.star_tracker import StarTracker

    camera = _camera(rig, vehicle)
    return StarTracker(
        vehicle,
        camera.camera,
        camera.ceiling,
        ExposureDelay(*camera.delay),
        camera.sky_settings,
        camera.identification,
    )


def _picture_keeper(rig: Rig, vehicle: str) -> Node:
    from groundstation.parts.stars.picture_keeper import PictureKeeper  # OpenCV loads only where it is used

    del rig
    return PictureKeeper(vehicle)


def _camera_port(rig: Rig, vehicle: str) -> Port | None:
    address = rig.vehicle(vehicle, StarsOfVehicle).star_camera
    if address is None:
        return None
    return StarCameraPort(f"{vehicle}/star_camera", vehicle, address, _camera(rig, vehicle).timeout_s)


def _stream_port(rig: Rig, vehicle: str) -> Port | None:
    address = rig.vehicle(vehicle, StarsOfVehicle).fixes
    return None if address is None else FixStreamPort(f"{vehicle}/fixes", vehicle, address)


def _check(rig: Rig) -> None:
    for type_ in rig.mock_ups.values():
        assert isinstance(type_, StarsOfType)
        camera = type_.star_camera
        if camera is not None:
            lens = camera.camera.value(CameraCalibration.parse)
            camera.ceiling.value(StarCatalogue.parse).check_in_view(lens, str(camera.ceiling.path))
            assert not any(map(math.isnan, camera.delay))
    for name, vehicle in rig.vehicles.items():
        own = rig.vehicle(name, StarsOfVehicle)
        if own.star_camera is not None and rig.of_type(name, StarsOfType).star_camera is None:
            raise ValueError(f"vehicles.{name}: an address without mock_ups.{vehicle.mock_up}.star_camera")
        check_address(rig, f"vehicles.{name}.star_camera", own.star_camera)
        check_address(rig, f"vehicles.{name}.fixes", own.fixes)


PART = Part(
    name="stars",
    summary="pictures of the ceiling become spots, stars and fixes",
    topics=(StarImage, PictureTrouble, StarSpots, StarFix, StarMatches, StarPicture, SkyChange, FixBytes),
    nodes=(
        NodeRow("fix_reader", FLIGHT, Weight.LIGHT, FixReader, _fix_reader, _has_stream),
        NodeRow("picture_check", SKY, Weight.LIGHT, _CHECK, _picture_check, _has_camera),
        NodeRow("spot_finder", SKY, Weight.HEAVY, _SPOTS, _spot_finder, _has_camera),
        NodeRow(
            "star_tracker",
            SKY,
            Weight.HEAVY,
            _TRACKER,
            _star_tracker,
            _has_camera,
        ),
        NodeRow(
            "picture_keeper",
            SKY,
            Weight.HEAVY,
            _KEEPER,
            _picture_keeper,
            _has_camera,
        ),
    ),
    ports=(
        PortRow("spot_finder", StarCameraPort, _camera_port),
        PortRow("fix_reader", FixStreamPort, _stream_port),
    ),
    actions=(PICTURE,),
    fix_sources=(FixSource("stars", StarFix, _has_stars, _floor, "'star_camera' or 'fixes'"),),
    mock_up=StarsOfType,
    vehicle=StarsOfVehicle,
    check=_check,
    gauges=GAUGES,
)
