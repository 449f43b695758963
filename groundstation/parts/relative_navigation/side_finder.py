"""Side finder: pictures of the camera on the hull in, place and turn of another mock-up or a refusal out."""

import math
from collections.abc import Iterator, Mapping

import cv2
import numpy as np

from drivers.star_camera.exposure import ExposureDelay
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.declarations.rig_file import RigFile
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.operation.messages import CalibrationInUse
from groundstation.parts.relative_navigation.messages import RelativePose, SideImage
from groundstation.parts.relative_navigation.who_is_where import WhoIsWhere
from groundstation.relative_navigation.side_bodies import SideBody
from groundstation.relative_navigation.side_camera import SideCamera
from groundstation.relative_navigation.side_looks import LOOKS
from groundstation.relative_navigation.sighting import Seen, Unseen
from groundstation.star_tracking.picture_repeats import PictureRepeats


class SideFinder(Node):
    """Looks for one mock-up in each picture that it is given.

    Args:
        vehicle: Its name.
        camera: The camera.
        body: Whom to look for.
        by: Row of the table of ways to look.
        files: Calibration files of both, for the record.
        delay: From the middle of the exposure to a picture's stamp.
        floor_sigma: What calibration leaves in every sighting: x, y (m), heading (rad).
        rivals: Other vehicles that may be taken for the one that is looked for, and how near the two bodies
            can come (m): a sighting that one of them explains as well is ambiguous.
    """

    inputs: tuple[type[Message], ...] = (SideImage,)
    outputs = (RelativePose, CalibrationInUse)

    def __init__(
        self,
        vehicle: str,
        camera: SideCamera,
        body: SideBody,
        by: str,
        files: tuple[RigFile, ...],
        delay: ExposureDelay,
        floor_sigma: tuple[float, float],
        rivals: Mapping[str, float] | None = None,
    ) -> None:
        super().__init__(vehicle)
        self._who = WhoIsWhere(vehicle, body, rivals or {})
        if rivals:
            self.inputs = (SideImage, VehicleState)
        cv2.setNumThreads(1)  # results must not depend on the number of cores
        self._camera, self._body, self._files, self._delay = camera, body, files, delay
        self._look = LOOKS[by](camera, body)
        xy_m, heading_rad = floor_sigma
        self._floor = np.diag((xy_m**2, xy_m**2, heading_rad**2))
        self._repeats = PictureRepeats()

    def start(self, now_ns: int) -> Iterator[Message]:
        yield CalibrationInUse.of(now_ns, self.vehicle, self._files)

    def sources(self, payload: type[Message]) -> tuple[str, ...]:
        return self._who.vehicles if payload is VehicleState else (self.vehicle,)

    def takes_paced(self, payload: type[Message], source: str) -> bool:
        del source
        return payload is VehicleState

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        del now_ns
        match message:
            case VehicleState():
                self._who.remember(message)
            case SideImage():
                yield self._looked(message)

    def _looked(self, message: SideImage) -> RelativePose:
        stamp_ns = self._delay.middle_ns(message.device_stamp_ns or message.stamp_ns)
        reason = self._mismatch(message)
        if reason:
            return self._unseen(stamp_ns, Unseen(reason))
        picture = np.frombuffer(message.data, np.uint8).reshape(message.height, message.width)
        reason = self._repeats.complaint_about(picture, message.stamp_ns)
        if reason:
            return self._unseen(stamp_ns, Unseen(reason))
        answer = self._look(picture)
        if isinstance(answer, Unseen):
            return self._unseen(stamp_ns, answer)
        reason = self._who.objection(answer, stamp_ns)
        if reason:
            return self._unseen(stamp_ns, Unseen(reason, is_ambiguous=True))
        return self._seen(stamp_ns, answer)

    def _mismatch(self, image: SideImage) -> str:
        """Why a picture is not what the camera's file speaks of; empty if it is."""
        lens = self._camera.lens
        if image.encoding != "mono8" or len(image.data) != image.width * image.height:
            size = f"{len(image.data)} bytes of {image.encoding}"
            return f"unusable picture: {size}, expected grey and whole"
        if (image.width, image.height) != (lens.width_px, lens.height_px):
            return (
                f"unusable picture: the camera gives {image.width} x {image.height} px, and its file states "
                f"{lens.width_px} x {lens.height_px}"
            )
        return ""

    def _seen(self, stamp_ns: int, seen: Seen) -> RelativePose:
        covariance = seen.covariance + self._floor
        x_m, y_m = seen.position_body_m.tolist()
        return RelativePose(
            stamp_ns,
            self.vehicle,
            self._body.vehicle,
            "solved",
            seen.range_m,
            seen.bearing_rad,
            (x_m, y_m),
            seen.heading_rad,
            tuple(covariance.ravel().tolist()),
            self._delay.delay_sigma_s,
            seen.points,
            seen.misfit,
            "",
        )

    def _unseen(self, stamp_ns: int, unseen: Unseen) -> RelativePose:
        nan = math.nan
        return RelativePose(
            stamp_ns,
            self.vehicle,
            self._body.vehicle,
            "ambiguous" if unseen.is_ambiguous else "lost",
            nan,
            nan,
            (nan, nan),
            nan,
            (nan,) * 9,
            self._delay.delay_sigma_s,
            0,
            nan,
            unseen.reason,
        )
