"""Overhead tracker: colour frames of the camera over the table in, a fix or a refusal per mock-up out."""

import math
from collections.abc import Iterator, Sequence

import cv2
import numpy as np

from drivers.star_camera.exposure import ExposureDelay
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.declarations.rig_file import RigFile
from groundstation.frames import wrap_angle
from groundstation.overhead import circle_tracker as overhead
from groundstation.overhead.liveries import parse_liveries
from groundstation.overhead.overhead_camera import OverheadCamera
from groundstation.parts.operation.messages import CalibrationInUse
from groundstation.parts.overhead.messages import OverheadFix, OverheadImage
from groundstation.star_tracking.picture_repeats import PictureRepeats


class OverheadTracker(Node):
    """Finds every mock-up of the rig in each frame that it is given.

    Args:
        vehicles: Those to speak of; other mock-ups that the file of circles knows are told apart from them.
        camera: Calibration file of the camera.
        circles: File that states what each mock-up wears.
        delay: From the middle of the exposure to a picture's stamp.

    Raises:
        FileError: A file is missing or wrong.
    """

    inputs = (OverheadImage,)
    outputs = (OverheadFix, CalibrationInUse)

    def __init__(
        self, vehicles: Sequence[str], camera: RigFile, circles: RigFile, delay: ExposureDelay
    ) -> None:
        super().__init__("")
        cv2.setNumThreads(1)  # results must not depend on the number of cores
        self._vehicles = tuple(vehicles)
        self._files = (camera, circles)
        self._tracker = overhead.OverheadTracker(
            camera.value(OverheadCamera.parse), circles.value(parse_liveries)
        )
        self._delay = delay
        self._repeats = PictureRepeats()

    def start(self, now_ns: int) -> Iterator[Message]:
        yield CalibrationInUse.of(now_ns, self.vehicle, self._files)

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        del now_ns
        assert isinstance(message, OverheadImage)
        exposure_ns = self._delay.middle_ns(message.device_stamp_ns or message.stamp_ns)
        image = np.frombuffer(message.data, np.uint8).reshape(message.height, message.width, 3)
        reason = self._repeats.complaint_about(image, message.stamp_ns)
        if reason:
            for vehicle in self._vehicles:
                yield self._refusal(exposure_ns, vehicle, reason)
            return
        try:
            answers = self._tracker.look(image)
        except ValueError as error:  # another camera than the file's
            for vehicle in self._vehicles:
                yield self._refusal(exposure_ns, vehicle, str(error))
            return
        for answer in answers:
            if answer.vehicle not in self._vehicles:
                continue
            if isinstance(answer, overhead.NoOverheadFix):
                yield self._refusal(exposure_ns, answer.vehicle, answer.reason)
                continue
            yield OverheadFix(
                exposure_ns,
                answer.vehicle,
                True,
                answer.x_m,
                answer.y_m,
                wrap_angle(answer.heading_rad),
                tuple(answer.covariance.ravel().tolist()),
                self._delay.delay_sigma_s,
                answer.circles,
                answer.whole,
                answer.misfit_m,
                "",
            )

    def _refusal(self, stamp_ns: int, vehicle: str, reason: str) -> OverheadFix:
        nan = math.nan
        return OverheadFix(
            stamp_ns, vehicle, False, nan, nan, nan, (nan,) * 9, self._delay.delay_sigma_s, 0, 0, nan, reason
        )
