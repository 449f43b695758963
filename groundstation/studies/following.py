"""A tracker given the frames of a separation, and its course beside the truth."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.laboratory.separations import Separation, SeparationOrder
from groundstation.relative_navigation.answers import Status, Track
from groundstation.relative_navigation.matching import Centres
from groundstation.relative_navigation.motion import CameraCraft
from groundstation.relative_navigation.motion_models import MOTION_MODELS, Tracker
from groundstation.relative_navigation.pinhole import PinholeCamera
from groundstation.relative_navigation.pose import Pose
from groundstation.relative_navigation.rotations import rotation_vectors, turn
from groundstation.relative_navigation.solvers import SOLVERS
from groundstation.relative_navigation.target import Target
from groundstation.relative_navigation.tracker_settings import Frame, TrackerSettings
from groundstation.studies.study import DEFAULT, PUBLISHED

Floats = NDArray[np.float64]

METHODS = {PUBLISHED: ("published", "newton"), DEFAULT: ("hill-euler", "lm")}
"""Of each side: motion model and solver."""


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """What a tracker answered.

    Attributes:
        times_s: Of the frames, (n,).
        is_solved: Whether a frame's own points stand behind its pose, (n,).
        positions_m: Camera axes, (n, 3); NaN where nothing is known.
        camera_from_body: (n, 3, 3); NaN likewise.
        velocities_m_s: Orbital axes, (n, 3); NaN likewise.
        rates_rad_s: Body axes, (n, 3); NaN likewise.
        off_m: Position minus truth, (n, 3).
        off_rad: Small turn about camera axes from the truth to the answer, (n, 3).
    """

    times_s: Floats
    is_solved: NDArray[np.bool_]
    positions_m: Floats
    camera_from_body: Floats
    velocities_m_s: Floats
    rates_rad_s: Floats
    off_m: Floats
    off_rad: Floats

    @property
    def away_m(self) -> Floats:
        """Length of the error of position, (n,)."""
        found: Floats = np.linalg.norm(self.off_m, axis=1)
        return found

    @property
    def away_deg(self) -> Floats:
        """Length of the error of the turn, (n,)."""
        found: Floats = np.degrees(np.linalg.norm(self.off_rad, axis=1))
        return found

    @property
    def turned_deg(self) -> Floats:
        """Rotation vector of the turn, camera axes, (n, 3); NaN where nothing is known."""
        found = np.full((len(self.times_s), 3), np.nan)
        known = np.isfinite(self.positions_m[:, 0])
        found[known] = np.degrees(rotation_vectors(self.camera_from_body[known]))
        return found

    def last_solved(self, gap: int) -> int | None:
        """Number of the last solved frame before so many unsolved ones in a row; None: not even the first."""
        unsolved = 0
        last = None
        for number, solved in enumerate(self.is_solved.tolist()):
            unsolved = 0 if solved else unsolved + 1
            if unsolved >= gap:
                break
            last = number if solved else last
        return last


def settings_of(
    order: SeparationOrder,
    truth: Separation,
    *,
    rate_rad_s: float,
    inertia_kg_m2: Floats | None = None,
    guess_off_rad: float = 0.05,
    guess_off_share: float = 0.02,
    reach_px: float | None = None,
    seed: int = 0,
) -> TrackerSettings:
    """Return what a tracker is told of an order.

    Args:
        order: That was flown.
        truth: Of it: the first guess is put off from it.
        rate_rad_s: Of the orbit, as it is believed to be.
        inertia_kg_m2: As they are believed to be; None: as they are.
        guess_off_rad: Turn of the first guess, about an axis drawn at random.
        guess_off_share: Of the distance: how much farther it is guessed to be.
        reach_px: The published neighbourhood; None: that of the method.
        seed: Of the axis.
    """
    axis = np.random.default_rng([seed, 17]).normal(size=3)
    off = turn(guess_off_rad * axis / np.linalg.norm(axis))
    guess = Pose(off @ truth.camera_from_body[0], (1.0 + guess_off_share) * truth.positions_camera_m[0])
    camera_from_orbital = order.camera_from_orbital
    width, height = order.size_px
    return TrackerSettings(
        PinholeCamera(order.f_px, 0.5 * (width - 1), 0.5 * (height - 1), width, height),
        Target(order.points_body_m, order.inertia_kg_m2 if inertia_kg_m2 is None else inertia_kg_m2),
        guess,
        reach_px,
        CameraCraft(rate_rad_s, lambda _t_s: camera_from_orbital),
    )


def tracker_of(side: str, settings: TrackerSettings) -> Tracker:
    """Return the tracker of a side."""
    motion, solver = METHODS[side]
    return MOTION_MODELS[motion](settings, SOLVERS[solver]())


def follow(tracker: Tracker, truth: Separation, centres: Iterable[Centres]) -> Course:
    """Give a tracker the centres of all frames."""
    pairs = zip(truth.times_s.tolist(), centres, strict=True)
    return course_of([tracker.look(Frame(number, t, seen)) for number, (t, seen) in enumerate(pairs)], truth)


def course_of(tracks: list[Track], truth: Separation) -> Course:
    """Lay answers beside the truth."""
    count = len(tracks)
    places, rotations = np.full((count, 3), np.nan), np.full((count, 3, 3), np.nan)
    for row, track in enumerate(tracks):
        if track.pose is not None:
            places[row], rotations[row] = track.pose.position_camera_m, track.pose.camera_from_body
    known = np.flatnonzero(np.isfinite(places[:, 0]))
    off = np.full((count, 3), np.nan)
    if len(known):
        off[known] = rotation_vectors(rotations[known] @ truth.camera_from_body[known].transpose(0, 2, 1))
    return Course(
        truth.times_s[:count],
        np.array([track.status is Status.SOLVED for track in tracks]),
        places,
        rotations,
        np.array([track.velocity_m_s for track in tracks]),
        np.array([track.rate_rad_s for track in tracks]),
        places - truth.positions_camera_m[:count],
        off,
    )
