"""Star tracker: light spots in, pose of the body or the reason for none out."""

import hashlib
import math
from collections import deque
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from calibration.camera.models import CameraCalibration
from calibration.camera.star_catalogue import StarCatalogue
from groundstation.frames import wrap_angle
from groundstation.messages.base import Message
from groundstation.messages.definitions import (
    CalibrationInUse,
    SkyChange,
    StarFix,
    StarSpots,
    VehicleState,
)
from groundstation.nodes.node import Node
from groundstation.star_tracking import fixes, tracker
from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.prior_governor import PriorGovernor
from groundstation.star_tracking.sky_watch import SkyWatch

MEMORY_NS = 2_000_000_000
REACH_NS = 50_000_000
"""Between two states of 100 Hz there are 10 ms; farther than this the IMU has fallen silent."""
_NO_COVARIANCE = (math.nan,) * 9


class StarTracker(Node):
    """Finds the ceiling in every set of spots, and names stars that died, moved or appeared.

    It starts from a prior where the state is known, else lost in space.

    Args:
        vehicle: Its name.
        camera: Calibration file of the camera.
        ceiling: Star catalogue.
        stamp_sigma_s: Standard deviation of the exposure's stamp.
        settings: Of the search, exposure and shutter included.

    Raises:
        CalibrationFileError: A file is missing or wrong.
    """

    inputs = (StarSpots, VehicleState)
    outputs = (StarFix, SkyChange, CalibrationInUse)

    def __init__(
        self,
        vehicle: str,
        camera: Path,
        ceiling: Path,
        stamp_sigma_s: float,
        settings: tracker.TrackerSettings,
    ) -> None:
        super().__init__(vehicle)
        self._files = (camera, ceiling)
        stars, lens = StarCatalogue.load(ceiling), CameraCalibration.load(camera)
        self._tracker = tracker.StarTracker(stars, lens, settings)
        self._watch = SkyWatch(stars, lens)
        self._governor = PriorGovernor()
        self._states: deque[VehicleState] = deque()
        self._stamp_sigma_s = stamp_sigma_s

    def start(self, now_ns: int) -> Iterator[Message]:
        content = [path.read_text() for path in self._files]
        name = " ".join(path.name for path in self._files)
        digest = hashlib.sha256("".join(content).encode()).hexdigest()
        yield CalibrationInUse(now_ns, self.vehicle, name, digest, "\n".join(content))

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        del now_ns
        match message:
            case VehicleState():
                self._remember(message)
            case StarSpots(reason="") as spots:
                yield from self._solve(spots)
            case StarSpots() as spots:
                yield self._refusal(spots, spots.reason)

    def _solve(self, spots: StarSpots) -> Iterator[Message]:
        state = self._state_at(spots.stamp_ns)
        prior = None if state is None else _prior(state, self._stamp_sigma_s)
        motion = None if state is None else fixes.BodyMotion(*state.velocity_table_m_s, state.rate_rad_s)
        lights = _spots(spots)
        answer = self._tracker.solve(lights, self._governor.admit(prior), motion)
        self._governor.note(answer, prior)
        if isinstance(answer, fixes.NoFix):
            yield self._refusal(spots, f"{answer.reason.value}: {answer.detail}")
            return
        yield StarFix(
            spots.stamp_ns,
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
        for found in self._watch.note(answer, lights):
            yield SkyChange(
                spots.stamp_ns,
                self.vehicle,
                found.change.value,
                found.star,
                found.x_m,
                found.y_m,
                found.std_m,
                found.sightings,
            )

    def _remember(self, state: VehicleState) -> None:
        """Keep two seconds of states, none of them of a lost filter."""
        states = self._states
        if state.status != "flying":
            states.clear()
            return
        states.append(state)
        while state.stamp_ns - states[0].stamp_ns > MEMORY_NS:
            states.popleft()

    def _state_at(self, stamp_ns: int) -> VehicleState | None:
        """The state at an exposure: the newest before it carried on, if that is not too far."""
        before = next((state for state in reversed(self._states) if state.stamp_ns <= stamp_ns), None)
        if before is None or stamp_ns - before.stamp_ns > REACH_NS:
            return None
        span_s = (stamp_ns - before.stamp_ns) * 1e-9
        (x, y), (vx, vy) = before.position_table_m, before.velocity_table_m_s
        return replace(
            before,
            stamp_ns=stamp_ns,
            position_table_m=(x + vx * span_s, y + vy * span_s),
            heading_rad=before.heading_rad + before.rate_rad_s * span_s,
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


def _prior(state: VehicleState, stamp_sigma_s: float) -> fixes.PosePrior:
    """What the filter believes of the pose at the exposure, whose stamp is uncertain too."""
    motion = np.array([*state.velocity_table_m_s, state.rate_rad_s])
    covariance = np.diag(np.square(state.pose_std)) + stamp_sigma_s**2 * np.outer(motion, motion)
    return fixes.PosePrior(*state.position_table_m, state.heading_rad, covariance)


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
