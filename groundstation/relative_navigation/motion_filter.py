"""Poses and motion put together: a filter over frames that learns how much of the motion no model explains.

Seven filters run side by side on the same frames. The one in the middle answers; each of the others believes
in ten times more or less unmodelled motion of one kind (turning, along the line of sight, across it). When a
neighbour has explained the last frames clearly better than the middle, the middle moves there. So a body that
flies as Hill and Euler say is averaged over many frames, one that is pushed about is followed, and in both
cases the covariance is that of the motion that was met.

A frame comes in as the information that its pixels hold about the pose near the solver's answer, not as a
pose with an inverse covariance: a frame that leaves a direction unknown adds nothing there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.innovations import Innovations
from groundstation.relative_navigation.motion import ACCELERATION, RATE, STATE, VELOCITY, CameraCraft
from groundstation.relative_navigation.motion_bank import PLACE, SPEED, SPIN, FrameInformation, MotionBank
from groundstation.relative_navigation.pose import Pose

Floats = NDArray[np.float64]

STEP = 10.0
"""Between neighbours, of the density of what is unmodelled."""
MEMBERS = 7
_OFFSETS = np.array(
    [[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=np.float64
)
"""Powers of `STEP` by member: of turning, along, across."""
MEMORY = 0.97
"""Share of the evidence kept from frame to frame: some thirty frames count."""
CLEARLY_BETTER = 1.2
"""Log of the likelihood ratio at which the middle moves."""
FIRST_TURN_RAD, FIRST_SHARE = 0.7, 0.15
"""Between the first two frames, one sigma: a turn, and a move by this share of its distance."""
TURN_FRAMES, ALONG_FRAMES, ACROSS_FRAMES = 12.0, 8.0, 2.0
"""How many frames the first belief averages over; across, a camera's own pointing comes in."""
SURPRISE = 25.0
"""Squared miss of a prediction in sigmas, three numbers or fewer, at which that motion is believed less."""
MOST_REOPENINGS = 12
WIDEST_TURN_RAD, WIDEST_SHARE = 2.0 * math.pi, 10.0
"""A prediction with such a sigma, of its turn or as a share of its distance, says nothing: to believe the
motion still less would only cost the digits of what is known."""
LEAST_MADE = 1e-12
"""Least over largest eigenvalue of a covariance that was made positive."""
LEAST_SCALED = 1e-13
"""Least eigenvalue of a pose covariance scaled to ones on its diagonal; below, rounding has eaten it."""


@dataclass(frozen=True, slots=True, eq=False)
class MotionEstimate:
    """What the filter believes at a time, of the target's centre of mass.

    Attributes:
        pose: Camera axes.
        velocity_m_s: In the orbital frame, orbital axes, (3,).
        rate_rad_s: Absolute, body axes, (3,).
        covariance: (12, 12): position, turn, velocity, rate.
    """

    pose: Pose
    velocity_m_s: Floats
    rate_rad_s: Floats
    covariance: Floats


class MotionFilter:
    """A target followed over frames.

    Args:
        craft: The craft that carries the camera.
        inertia_kg_m2: Of the target, (3,); None: its rates stay as they are but for noise.
        t_s: Of the first frame.
        first: Its information.
        covariance: Of its pose, (6, 6).
    """

    def __init__(
        self, craft: CameraCraft, inertia_kg_m2: Floats | None, t_s: float, first: Pose, covariance: Floats
    ) -> None:
        self.t_s = t_s
        self.frames = 1
        self._craft, self._inertia = craft, inertia_kg_m2
        self._bank = MotionBank.at(MEMBERS, first, covariance)
        if craft.orbital_rate_rad_s > 0.0:  # a camera that keeps still in the orbital frame sees it turn
            self._bank.states[:, SPIN] = first.camera_from_body.T @ (
                craft.camera_from_orbital(t_s) @ np.array((0.0, 0.0, craft.orbital_rate_rad_s))
            )
        self._levels = np.zeros(3)
        self._unit = np.ones((3, 1))
        self._evidence = np.zeros(MEMBERS)
        self._innovations = Innovations()
        self._before = t_s, self._bank.copy()

    def predict(self, t_s: float) -> None:
        """Carry all members to a time."""
        dt = t_s - self.t_s
        if dt == 0.0:
            return
        if self.frames == 1:
            self._widen(dt)
        self._before = self.t_s, self._bank.copy()
        densities = np.power(STEP, self._levels + _OFFSETS) * self._unit[:, 0]
        self._bank.predict(self._craft, self._inertia, self.t_s, t_s, densities)
        self.t_s = t_s
        if not self.is_sound():
            self._make_positive()

    def _make_positive(self) -> None:
        """Take what rounding has made negative for as much variance: no less is unknown than was lost.

        A long way between frames carries a wide belief of velocity into the place, where it cancels.
        """
        covariances = self._bank.covariances
        if not np.isfinite(covariances).all():
            return
        size = np.sqrt(np.abs(covariances[:, range(STATE), range(STATE)]))
        size[size == 0.0] = 1.0
        scale = size[:, :, None] * size[:, None, :]
        scaled = covariances / scale
        values, vectors = np.linalg.eigh(0.5 * (scaled + scaled.transpose(0, 2, 1)))
        values = np.maximum(np.abs(values), LEAST_MADE * values[:, -1:])
        covariances[:] = scale * ((vectors * values[:, None, :]) @ vectors.transpose(0, 2, 1))

    def reopen(self, pose: Pose) -> None:
        """Believe the models less until the last prediction could have led to a pose that a frame showed.

        Only what the frame contradicts is believed less: turning, motion along the line of sight, or across
        it.
        """
        if self.frames < 2:
            return
        t_s = self.t_s
        for _ in range(MOST_REOPENINGS):
            mean, covariance = self.prior
            off = pose.minus(mean)
            sight = mean.position_camera_m / np.linalg.norm(mean.position_camera_m)
            side = np.eye(3) - np.outer(sight, sight)
            _, axes = np.linalg.eigh(side)
            surprises = (
                _square(off[3:], covariance[3:, 3:]),
                _square(off[:3] @ axes[:, :1], axes[:, :1].T @ covariance[:3, :3] @ axes[:, :1]),
                _square(off[:3] @ axes[:, 1:], axes[:, 1:].T @ covariance[:3, :3] @ axes[:, 1:]),
            )
            reach = WIDEST_SHARE * float(np.linalg.norm(mean.position_camera_m))
            spread = np.diag(axes.T @ covariance[:3, :3] @ axes)
            wide = (
                float(np.trace(covariance[3:, 3:])) > WIDEST_TURN_RAD**2,
                float(spread[0]) > reach**2,
                float(spread[1:].sum()) > reach**2,
            )
            worse = np.array([s > SURPRISE and not w for s, w in zip(surprises, wide, strict=True)])
            if not worse.any():
                return
            self._innovations.forget()
            self._levels = self._levels + worse
            self._evidence = np.zeros(MEMBERS)
            before_s, bank = self._before
            self.t_s, self._bank = before_s, bank.copy()
            self.predict(t_s)

    def _widen(self, dt: float) -> None:
        """Before the second frame nothing is known of rates: their scale comes from frames and distance."""
        place, covariances = self._bank.states[0, PLACE], self._bank.covariances
        distance = float(np.linalg.norm(place))
        reach = FIRST_SHARE * distance / dt
        diagonal = covariances[:, range(STATE), range(STATE)]
        diagonal[:, VELOCITY] = reach**2
        diagonal[:, RATE] = (FIRST_TURN_RAD / dt) ** 2
        diagonal[:, ACCELERATION] = (0.3 * reach / dt) ** 2
        covariances[:, range(STATE), range(STATE)] = diagonal
        pose, sight = covariances[0, :6, :6], place / distance
        along = float(sight @ pose[:3, :3] @ sight)
        across = 0.5 * (float(np.trace(pose[:3, :3])) - along)
        turn = float(np.trace(pose[3:, 3:])) / 3.0
        units = (
            turn / (TURN_FRAMES**4 * dt**3),
            along / (ALONG_FRAMES**6 * dt**5),
            across / (ACROSS_FRAMES**6 * dt**5),
        )
        self._unit = np.maximum(np.array(units)[:, None], 1e-30)

    @property
    def prior(self) -> tuple[Pose, Floats]:
        """Predicted pose of the middle member and its covariance (6, 6)."""
        return self._bank.pose(0), self._bank.covariances[0, :6, :6].copy()

    def update(self, frame: FrameInformation) -> float:
        """Take a frame at the time of the last prediction.

        Returns:
            Log of the likelihood that the middle member gave it, up to a constant.
        """
        if self.frames > 2:  # before, nothing is foretold
            self._innovations.note(*self.prior, frame)
        likelihood = self._bank.update(frame)
        self.frames += 1
        if self.frames > 3:  # before, the wide beliefs about rates decide
            self._learn(likelihood)
        return float(likelihood[0])

    def _learn(self, likelihood: Floats) -> None:
        self._evidence = MEMORY * self._evidence + likelihood
        best = int(self._evidence.argmax())
        if self._evidence[best] - self._evidence[0] < CLEARLY_BETTER:
            return
        self._levels = self._levels + _OFFSETS[best]
        opposite = int(np.flatnonzero(np.all(np.equal(_OFFSETS, -_OFFSETS[best]), axis=1))[0])
        source = np.full(MEMBERS, best)
        source[opposite] = 0
        self._bank = MotionBank(self._bank.states[source], self._bank.covariances[source])
        self._evidence = np.where(source == best, 0.0, self._evidence[0] - self._evidence[best])

    @property
    def estimate(self) -> MotionEstimate:
        """What the middle member believes; a bias that the frames show is in its covariance."""
        row = self._bank.states[0]
        covariance = self._bank.covariances[0, :12, :12].copy()
        covariance[:6, :6] += self._innovations.bias
        return MotionEstimate(
            self._bank.pose(0),
            row[SPEED].copy(),
            row[SPIN].copy(),
            covariance,
        )

    @property
    def is_contradicted(self) -> bool:
        """Whether the last frames miss their predictions by more than both are said to be wrong."""
        return self._innovations.are_too_large

    @property
    def unmodelled(self) -> tuple[float, float, float]:
        """Learned densities: turning rad^2/s^3, along and across the line of sight m^2/s^5."""
        if self.frames == 1:
            return 0.0, 0.0, 0.0
        turn, along, across = (np.power(STEP, self._levels) * self._unit[:, 0]).tolist()
        return turn, along, across

    def is_sound(self) -> bool:
        """Whether nothing has run away, and the covariance of the pose is one: symmetric and positive."""
        if not math.isfinite(float(self._bank.covariances.sum()) + float(self._bank.states.sum())):
            return False
        pose = self._bank.covariances[0, :6, :6]
        size = np.diag(pose)
        if not float(size.min()) > 0.0:
            return False
        scaled = pose / np.sqrt(np.outer(size, size))
        return float(np.linalg.eigvalsh(scaled)[0]) > LEAST_SCALED


def _square(off: Floats, covariance: Floats) -> float:
    return float(off @ np.linalg.solve(covariance, off))
