"""Keys of a rig file for side cameras, and the switch by what a follower knows its leader."""

from typing import Literal

from groundstation.declarations.rig_file import RigFile
from groundstation.declarations.section import Delay, Positive, Section, Sigma


class SideCameraSection(Section):
    """The side camera of a type of mock-up: its files, its delay and the floor of its errors.

    ``bodies`` is what every mock-up looks like from the side. The sigmas are what calibration of the camera
    leaves in every sighting, beyond the covariance that comes with it.
    """

    camera: RigFile
    bodies: RigFile
    delay_s: Delay = 0.0
    delay_sigma_s: Delay = 0.002
    timeout_s: Positive = 2.0
    sigma_xy_m: Sigma = 0.0005
    sigma_heading_rad: Sigma = 0.001


class SideCameraOfVehicleSection(Section):
    """Where a vehicle's side camera is opened, whom it looks for, and by what."""

    address: str
    looks_for: str
    by: Literal["markers", "lit_part"] = "markers"


class RelativeNavigationOfType(Section):
    """Keys of a type of mock-up."""

    side_camera: SideCameraSection | None = None


class RelativeNavigationOfVehicle(Section):
    """Keys of a vehicle.

    ``leader_by`` is the switch: whom its side camera looks for is known to its controller by ``star_fixes``,
    the other's own estimate, or by ``side_camera``.
    """

    side_camera: SideCameraOfVehicleSection | None = None
    leader_by: Literal["star_fixes", "side_camera"] = "star_fixes"

    def leader_seen(self) -> str:
        """Name of the vehicle that the controller knows by the side camera; empty where there is none."""
        if self.side_camera is None or self.leader_by != "side_camera":
            return ""
        return self.side_camera.looks_for
