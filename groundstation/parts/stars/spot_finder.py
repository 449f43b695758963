"""Spot finder: camera frames in, light spots out."""

from collections.abc import Iterator

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.parts.stars.messages import StarImage, StarSpots
from groundstation.star_tracking.detection import Detector, PictureError
from groundstation.star_tracking.fixes import Refusal
from groundstation.star_tracking.identifications import FindSpots

_NONE = np.empty(0, np.float32)


class SpotFinder(Node):
    """Looks for stars in every frame that it is given; one that it cannot use is reported with the reason.

    Args:
        vehicle: Its name.
        size_px: Columns and rows of the frames for which the camera is calibrated; None for any.
        find: Finds the spots of a picture; the default detector if None.
    """

    inputs = (StarImage,)
    outputs = (StarSpots,)

    def __init__(
        self, vehicle: str, size_px: tuple[int, int] | None = None, find: FindSpots | None = None
    ) -> None:
        super().__init__(vehicle)
        self._size_px = size_px
        self._find = Detector().find if find is None else find
        cv2.setNumThreads(1)  # results must not depend on the number of cores

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        del now_ns
        assert isinstance(message, StarImage)
        reason = self._mismatch(message)
        if reason:
            yield self._unusable(message, reason)
            return
        image = np.frombuffer(message.data, np.uint8).reshape(message.height, message.width)
        try:
            spots = self._find(image)
        except PictureError as error:
            yield self._unusable(message, str(error))
            return
        if spots.seam:
            yield self._unusable(message, f"{Refusal.TORN}: {spots.seam}")
            return
        yield StarSpots(
            message.stamp_ns,
            self.vehicle,
            message.device_stamp_ns,
            _single(spots.u_px),
            _single(spots.v_px),
            _single(spots.flux_dn),
            _single(spots.covariance_px2),
            _single(spots.elongation),
            _single(spots.streak_px),
            spots.background_dn,
            spots.noise_dn,
            spots.hot_pixels,
            spots.cut_by_edge,
            spots.is_flooded,
            "",
        )

    def _mismatch(self, image: StarImage) -> str:
        """Why a frame is not what the camera is calibrated for; empty if it is."""
        if image.encoding != "mono8":
            return f"unusable picture: it comes as {image.encoding}, expected grey (mono8)"
        if len(image.data) != image.width * image.height:
            size = f"{image.width} x {image.height} px"
            return f"unusable picture: cut short, {len(image.data)} bytes for {size}"
        if self._size_px not in (None, (image.width, image.height)):
            width, height = self._size_px or (0, 0)
            return (
                f"unusable picture: the camera gives {image.width} x {image.height} px and is calibrated "
                f"for {width} x {height}: set its size, or calibrate it again"
            )
        return ""

    def _unusable(self, image: StarImage, reason: str) -> StarSpots:
        none = (_NONE,) * 6
        return StarSpots(
            image.stamp_ns, self.vehicle, image.device_stamp_ns, *none, 0.0, 0.0, 0, 0, False, reason
        )


def _single(values: NDArray[np.float64]) -> NDArray[np.float32]:
    """Single precision: 3e-5 px at the edge of the frame, far below any noise, and half the recording."""
    return values.ravel().astype(np.float32)
