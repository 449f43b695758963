"""Keys of a rig file for motion capture: the system, its frame on the table, and its rigid bodies."""

from typing import Any, Literal

from groundstation.declarations.section import Delay, Positive, Section, Sigma

Triple = tuple[float, float, float]


class MotionCaptureSection(Section):
    """The system, and how its frame lies to the table.

    ``address`` is what the library takes (``{ system = "optitrack", hostname = "192.168.1.10" }``) or the
    laboratory's channel. ``delay_s`` counts from the exposure to the arrival. The sigmas are those of one
    pose, calibration of the frame included.
    """

    address: dict[str, Any] | str
    delay_s: Delay = 0.01
    delay_sigma_s: Delay = 0.002
    timeout_s: Positive = 1.0
    up: Literal["y", "z"] = "z"
    origin_table_m: Triple = (0.0, 0.0, 0.0)
    yaw_deg: float = 0.0
    sigma_xy_m: Sigma = 0.0005
    sigma_heading_rad: Sigma = 0.001


class MotionCaptureOfRig(Section):
    """Keys of the rig."""

    motion_capture: MotionCaptureSection | None = None


class CapturedBodySection(Section):
    """A vehicle's rigid body: its name in the system, where its pivot sits, whether it is the reference."""

    body: str | None = None
    pivot_body_m: tuple[float, float] = (0.0, 0.0)
    pivot_yaw_deg: float = 0.0
    is_reference: bool = False


class MotionCaptureOfVehicle(Section):
    """Keys of a vehicle."""

    motion_capture: CapturedBodySection | None = None
