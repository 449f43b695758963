"""Star tracker: light spots in, pose of the body or the reason for none out."""

import hashlib
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from calibration.camera.models import CameraCalibration
from calibration.camera.star_catalogue import StarCatalogue
from groundstation.frames import wrap_angle
from groundstation.messages.base import Message
from groundstation.messages.definitions import CalibrationInUse, StarFix, StarSpots
from groundstation.nodes.node import Node
from groundstation.star_tracking import fixes, tracker
from groundstation.star_tracking.detection import Spots

_NO_COVARIANCE = (math.nan,) * 9


class StarTracker(Node):
    """Finds the ceiling in every set of spots, lost in space.

    Args:
        vehicle: Its name.
        camera: Calibration file of the camera.
        ceiling: Star catalogue.
        stamp_sigma_s: Standard deviation of the exposure's stamp.

    Raises:
        CalibrationFileError: A file is missing or wrong.
    """

    inputs = (StarSpots,)
    outputs = (StarFix, CalibrationInUse)

    def __init__(self, vehicle: str, camera: Path, ceiling: Path, stamp_sigma_s: float) -> None:
        super().__init__(vehicle)
        self._files = (camera, ceiling)
        self._tracker = tracker.StarTracker(StarCatalogue.load(ceiling), CameraCalibration.load(camera))
        self._stamp_sigma_s = stamp_sigma_s

    def start(self, now_ns: int) -> Iterator[Message]:
        content = [path.read_text() for path in self._files]
        name = " ".join(path.name for path in self._files)
        digest = hashlib.sha256("".join(content).encode()).hexdigest()
        yield CalibrationInUse(now_ns, self.vehicle, name, digest, "\n".join(content))

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        del now_ns
        assert isinstance(message, StarSpots)
        if message.reason:
            yield self._refusal(message, message.reason)
            return
        answer = self._tracker.solve(_spots(message))
        if isinstance(answer, fixes.NoFix):
            yield self._refusal(message, f"{answer.reason.value}: {answer.detail}")
            return
        yield StarFix(
            message.stamp_ns,
            self.vehicle,
            True,
            answer.x_m,
            answer.y_m,
            wrap_angle(answer.heading_rad),
            tuple(answer.cov.ravel().tolist()),
            self._stamp_sigma_s,
            answer.stars,
            answer.mode.value,
            "",
        )

    def _refusal(self, spots: StarSpots, reason: str) -> StarFix:
        nowhere = (math.nan,) * 3
        return StarFix(
            spots.stamp_ns,
            self.vehicle,
            False,
            *nowhere,
            _NO_COVARIANCE,
            self._stamp_sigma_s,
            0,
            fixes.Mode.LOST_IN_SPACE.value,
            reason,
        )


def _spots(message: StarSpots) -> Spots:
    def double(values: np.ndarray, *shape: int) -> np.ndarray:
        return values.astype(np.float64).reshape(shape)

    return Spots(
        double(message.u_px, -1),
        double(message.v_px, -1),
        double(message.flux_dn, -1),
        double(message.covariance_px2, -1, 3),
        double(message.elongation, -1),
        double(message.streak_px, -1, 2),
        message.background_dn,
        message.noise_dn,
        message.hot_pixels,
        message.cut_by_edge,
        message.flooded,
    )
