"""Capture reader: poses of rigid bodies in, fixes and reference poses of vehicles out."""

import math
from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.frames import wrap_angle
from groundstation.parts.motion_capture.capture_frame import CaptureFrame, TablePose
from groundstation.parts.motion_capture.messages import CapturedPose, CaptureFix
from groundstation.parts.reference.messages import ReferenceState

MOST_TILT_RAD = 0.1
"""A mock-up lies flat: a body tilted more is another one, or its markers were swapped."""
VELOCITY_OVER_NS = 60_000_000


@dataclass(frozen=True, slots=True)
class CapturedBody:
    """A vehicle's rigid body.

    Attributes:
        vehicle: Whose it is.
        pivot_body_m: Its pivot from the body origin.
        pivot_yaw_rad: From body +x to its +x.
        is_reference: Whether its poses are the vehicle's reference, too.
    """

    vehicle: str
    pivot_body_m: tuple[float, float]
    pivot_yaw_rad: float
    is_reference: bool


@dataclass(slots=True)
class _Past:
    poses: deque[tuple[int, TablePose]] = field(default_factory=deque)

    def velocity(self, stamp_ns: int, pose: TablePose) -> tuple[float, float, float]:
        """Mean over the last poses, m/s, m/s, rad/s; zeros before the second."""
        poses = self.poses
        poses.append((stamp_ns, pose))
        while len(poses) > 2 and stamp_ns - poses[1][0] >= VELOCITY_OVER_NS:
            poses.popleft()
        first_ns, first = poses[0]
        span_s = (stamp_ns - first_ns) * 1e-9
        if span_s <= 0.0:
            return 0.0, 0.0, 0.0
        turn_rad = wrap_angle(pose.heading_rad - first.heading_rad)
        return (pose.x_m - first.x_m) / span_s, (pose.y_m - first.y_m) / span_s, turn_rad / span_s


class CaptureReader(Node):
    """Carries poses from the system's frame to the table's, exposures from arrivals.

    Args:
        frame: How the system lies to the table.
        bodies: Those of the vehicles, by their names in the system.
        delay_s: From the exposure to the arrival.
        delay_sigma_s: Its standard deviation.
        sigma_xy_m: Of one pose, per axis.
        sigma_heading_rad: Of one pose.
        body_up: Which axis of a rigid body points up.
    """

    inputs = (CapturedPose,)
    outputs = (CaptureFix, ReferenceState)

    def __init__(
        self,
        frame: CaptureFrame,
        bodies: Mapping[str, CapturedBody],
        delay_s: float,
        delay_sigma_s: float,
        sigma_xy_m: float,
        sigma_heading_rad: float,
        body_up: str,
    ) -> None:
        super().__init__("")
        self._frame = frame
        self._bodies = bodies
        self._delay_ns = round(delay_s * 1e9)
        self._delay_sigma_s = delay_sigma_s
        variance = (sigma_xy_m**2, sigma_xy_m**2, sigma_heading_rad**2)
        self._covariance = tuple(
            variance[row] if row == column else 0.0 for row in range(3) for column in range(3)
        )
        self._body_up = body_up
        self._past = {name: _Past() for name in bodies}

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        del now_ns
        assert isinstance(message, CapturedPose)
        body = self._bodies.get(message.body)
        if body is None:
            return
        exposure_ns = message.stamp_ns - self._delay_ns
        if not message.is_tracked:
            yield self._refusal(exposure_ns, body.vehicle, "not tracked", math.nan)
            return
        try:
            pose = self._frame.pose(
                message.position_capture_m,
                message.quaternion_xyzw,
                body.pivot_body_m,
                body.pivot_yaw_rad,
                self._body_up,
            )
        except ValueError as error:
            yield self._refusal(exposure_ns, body.vehicle, str(error), math.nan)
            return
        if not pose.tilt_rad <= MOST_TILT_RAD:
            reason = f"tilted by {math.degrees(pose.tilt_rad):.0f} deg: another body, or markers swapped"
            yield self._refusal(exposure_ns, body.vehicle, reason, pose.tilt_rad)
            return
        yield CaptureFix(
            exposure_ns,
            body.vehicle,
            True,
            pose.x_m,
            pose.y_m,
            pose.heading_rad,
            self._covariance,
            self._delay_sigma_s,
            pose.tilt_rad,
            "",
        )
        if body.is_reference:
            vx_m_s, vy_m_s, rate_rad_s = self._past[message.body].velocity(exposure_ns, pose)
            yield ReferenceState(
                exposure_ns,
                body.vehicle,
                (pose.x_m, pose.y_m),
                pose.heading_rad,
                (vx_m_s, vy_m_s),
                rate_rad_s,
            )

    def _refusal(self, exposure_ns: int, vehicle: str, reason: str, tilt_rad: float) -> CaptureFix:
        nowhere, nothing = (math.nan,) * 3, (math.nan,) * 9
        return CaptureFix(
            exposure_ns, vehicle, False, *nowhere, nothing, self._delay_sigma_s, tilt_rad, reason
        )
