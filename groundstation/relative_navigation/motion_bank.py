"""Members of a filter, carried between frames and corrected by what a frame says: the core does it.

Each member is one belief about a target's centre of mass and its turn: rotation, position, velocity, rate,
acceleration, in one row of numbers, and the covariance of their errors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.core.library import default_core
from groundstation.relative_navigation.attitude_motion import MOST_STEPS, STEP_RAD
from groundstation.relative_navigation.hill import hill_response, hill_transition
from groundstation.relative_navigation.motion import STATE, CameraCraft
from groundstation.relative_navigation.pose import Pose

Floats = NDArray[np.float64]

MEMBER = 21
"""Numbers of a member."""
ROTATION, PLACE, SPEED, SPIN, PULL = slice(0, 9), slice(9, 12), slice(12, 15), slice(15, 18), slice(18, 21)
"""Of its row: camera from body, by rows; position in camera axes (m); velocity in the turning orbital frame,
orbital axes (m/s); absolute rate, body axes (rad/s); the acceleration that Hill's equations do not explain,
orbital axes (m/s^2)."""


@dataclass(frozen=True, slots=True, eq=False)
class FrameInformation:
    """What a frame says: the log of its likelihood is ``-(d I d - 2 b d + cost)/2`` for errors d of a pose.

    Attributes:
        pose: Where it was taken; of the centre of mass.
        information: I, (6, 6).
        gradient: b, (6,).
        cost: Sum of squares of the whitened residuals there.
    """

    pose: Pose
    information: Floats
    gradient: Floats
    cost: float


@dataclass(frozen=True, slots=True, eq=False)
class MotionBank:
    """Members side by side; both arrays are changed in place.

    Attributes:
        states: (m, 21).
        covariances: (m, 15, 15).

    Raises:
        ValueError: Their shapes are others, or the members too many.
    """

    states: Floats
    covariances: Floats

    def __post_init__(self) -> None:
        lib = default_core().lib
        count = len(self.states)
        wanted = ((count, lib.MEMBER), (count, lib.MEMBER_ERRORS, lib.MEMBER_ERRORS))
        if (self.states.shape, self.covariances.shape) != wanted or not 0 < count <= lib.MOST_MEMBERS:
            raise ValueError(
                f"members are at most {lib.MOST_MEMBERS}, of {lib.MEMBER} numbers and {lib.MEMBER_ERRORS} "
                f"errors, found {self.states.shape} and {self.covariances.shape}"
            )

    @classmethod
    def at(cls, count: int, pose: Pose, covariance: Floats) -> MotionBank:
        """Members that stand still at a pose of which the covariance (6, 6) is known."""
        states, covariances = np.zeros((count, MEMBER)), np.zeros((count, STATE, STATE))
        states[:, ROTATION] = pose.camera_from_body.ravel()
        states[:, PLACE] = pose.position_camera_m
        covariances[:, :6, :6] = covariance
        return cls(states, covariances)

    def copy(self) -> MotionBank:
        """Return another one that is equal."""
        return MotionBank(self.states.copy(), self.covariances.copy())

    def pose(self, member: int) -> Pose:
        """Return where a member believes the target."""
        row = self.states[member]
        return Pose(row[ROTATION].reshape(3, 3).copy(), row[PLACE].copy())

    def predict(
        self,
        craft: CameraCraft,
        inertia_kg_m2: Floats | None,
        begin_s: float,
        end_s: float,
        densities: Floats,
    ) -> None:
        """Carry all members over a span.

        Args:
            craft: That carries the camera.
            inertia_kg_m2: Of the target, (3,); None: its rates stay in the body.
            begin_s: Time of the members.
            end_s: Time to carry them to.
            densities: Of what is unmodelled, (m, 3): angular acceleration (rad^2/s^3), change of acceleration
                along the line of sight and across it (m^2/s^5).
        """
        core = default_core()
        n, dt = craft.orbital_rate_rad_s, end_s - begin_s
        span = core.ffi.new(
            "Span *",
            {
                "begin": craft.camera_from_orbital(begin_s).ravel().tolist(),
                "end": craft.camera_from_orbital(end_s).ravel().tolist(),
                "swing": craft.turned_by(begin_s, end_s).ravel().tolist(),
                "carry": hill_transition(n, dt).ravel().tolist(),
                "push": hill_response(n, dt).ravel().tolist(),
                "camera_m": craft.camera_from_mass_m.tolist(),
                "dt_s": dt,
                "orbital_rate": n,
                "inertia": [0.0, 0.0, 0.0] if inertia_kg_m2 is None else inertia_kg_m2.tolist(),
                "has_inertia": inertia_kg_m2 is not None,
                "step_rad": STEP_RAD,
                "most_steps": MOST_STEPS,
            },
        )
        given = np.ascontiguousarray(densities, dtype=np.float64)
        core.lib.gs_bank_predict(
            span,
            len(self.states),
            core.doubles(self.states),
            core.doubles(self.covariances),
            core.doubles(given),
        )

    def update(self, frame: FrameInformation) -> Floats:
        """Correct all members by a frame at their time; logs of the likelihood each gave it, (m,)."""
        core = default_core()
        pose = np.concatenate((frame.pose.camera_from_body.ravel(), frame.pose.position_camera_m))
        information = np.ascontiguousarray(frame.information, dtype=np.float64)
        gradient = np.ascontiguousarray(frame.gradient, dtype=np.float64)
        likelihood = np.empty(len(self.states))
        core.lib.gs_bank_update(
            core.ffi.cast("RigidPose *", pose.ctypes.data),
            core.doubles(information),
            core.doubles(gradient),
            frame.cost,
            len(self.states),
            core.doubles(self.states),
            core.doubles(self.covariances),
            core.doubles(likelihood),
        )
        return likelihood
