"""Frames followed as published: predicted by Hill's and Euler's equations, rates by differences of poses.

Ivanov, Karpenko, Ovchinnikov 2012 (Chibis-M), section 2.2; Simakov, Ustyugov 2016 likewise. The state of the
last frame is carried on to the next; in a neighbourhood of each predicted point the nearest centre is taken;
the solver begins at the prediction, and its answer is the next state. A frame with fewer than four points
that span space corrects nothing: the prediction is the answer and is carried on, errors and all. What the
publication does not say: one centre serves one point only, and rates before the second frame are zero.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.answers import NOTHING3, Reason, Status, Track, lost
from groundstation.relative_navigation.first_poses import enough, first_poses
from groundstation.relative_navigation.matching import Centres, Matches, match_labelled, match_near
from groundstation.relative_navigation.motion import POSITION, RATE, TURN, VELOCITY
from groundstation.relative_navigation.motion_bank import SPEED, SPIN, MotionBank
from groundstation.relative_navigation.pixel_equations import predicted_pixels
from groundstation.relative_navigation.pose import Pose, PoseFit
from groundstation.relative_navigation.rotations import rotation_vector
from groundstation.relative_navigation.solvers import PoseSolver
from groundstation.relative_navigation.subset_search import sight_of
from groundstation.relative_navigation.tracker_settings import Frame, TrackerSettings

Floats = NDArray[np.float64]

REACH_PX = 12.0
"""The published neighbourhood epsilon where the case gives none; no value is published: assumed."""


@dataclass(frozen=True, slots=True, eq=False)
class _State:
    """What is carried on: of the centre of mass, with the covariance of its 15 errors."""

    t_s: float
    bank: MotionBank
    has_rates: bool

    @property
    def pose(self) -> Pose:
        return self.bank.pose(0)


class PublishedFrames:
    """Follows a target as published.

    Args:
        settings: The case.
        solver: From centres to a pose; it begins at the prediction and is told no prior.
    """

    def __init__(self, settings: TrackerSettings, solver: PoseSolver) -> None:
        self._settings, self._solver = settings, solver
        self._rng = np.random.default_rng(settings.seed)
        self._state: _State | None = None
        self._solved: tuple[float, PoseFit] | None = None

    def look(self, frame: Frame) -> Track:
        """Take the next frame; times must grow."""
        if self._state is None:
            if self._settings.guess_of_mass is None:
                return self._begin(frame)
            self._state = self._guessed(frame.t_s)
        ahead = self._carried(self._state, frame.t_s)
        matches = self._matches(frame.centres, ahead.pose)
        fit = None
        if enough(matches, self._settings.target):
            points = self._settings.target.points_from_mass_m
            sight = sight_of(frame.centres, matches)
            fit = self._solver(self._settings.camera, points, sight, ahead.pose, None)
        if fit is None or not fit.converged:
            self._state = ahead
            reason = Reason.TOO_FEW_POINTS if fit is None else Reason.NO_SOLUTION
            return self._track(
                frame, ahead, Status.PROPAGATED, Reason.NO_POINTS if not len(frame.centres) else reason
            )
        fit = _honest(fit, len(matches))
        self._state = self._corrected(frame.t_s, fit)
        self._solved = (frame.t_s, fit)
        return self._track(frame, self._state, Status.SOLVED, Reason.NONE, matches)

    def _guessed(self, t_s: float) -> _State:
        """The published start: the first prediction is the given one, at rest."""
        settings = self._settings
        guess = settings.guess_of_mass
        assert guess is not None
        return _State(t_s, MotionBank.at(1, guess, settings.guess_covariance()), has_rates=False)

    def _begin(self, frame: Frame) -> Track:
        """Without a guess the first pose is searched for; the publication needs one."""
        candidates = first_poses(frame.centres, self._settings, self._rng)
        if not candidates:
            few = len(frame.centres) < 4
            return lost(frame.number, frame.t_s, Reason.TOO_FEW_POINTS if few else Reason.NO_AGREEMENT)
        best = candidates[0]
        self._state = self._corrected(frame.t_s, best.fit)
        self._solved = (frame.t_s, best.fit)
        return self._track(frame, self._state, Status.SOLVED, Reason.NONE, best.matches)

    def _carried(self, state: _State, t_s: float) -> _State:
        """The state at another time, by the equations of motion alone."""
        bank, settings = state.bank.copy(), self._settings
        bank.predict(settings.craft, settings.target.inertia_kg_m2, state.t_s, t_s, np.zeros((1, 3)))
        return _State(t_s, bank, state.has_rates)

    def _matches(self, centres: Centres, pose: Pose) -> Matches:
        settings = self._settings
        if centres.points is not None:
            return match_labelled(centres, len(settings.target))
        if not len(centres):
            return match_labelled(centres, 0)
        reach = REACH_PX if settings.reach_px is None else settings.reach_px
        predicted = predicted_pixels(settings.camera, settings.target.points_from_mass_m, pose)
        wide = np.broadcast_to(reach**2 * np.eye(2), (len(predicted), 2, 2))
        return match_near(predicted, wide, centres, reach)

    def _corrected(self, t_s: float, fit: PoseFit) -> _State:
        """The state that a solved frame gives: its pose, and rates by differences to the last solved one."""
        bank = MotionBank.at(1, fit.pose, fit.covariance)
        if self._solved is None:
            return _State(t_s, bank, has_rates=False)
        begin_s, last = self._solved
        dt, craft = t_s - begin_s, self._settings.craft
        begin, end = craft.camera_from_orbital(begin_s), craft.camera_from_orbital(t_s)
        arm = craft.camera_from_mass_m
        way = (fit.pose.position_camera_m + arm) @ end - (last.pose.position_camera_m + arm) @ begin
        swing = craft.turned_by(begin_s, t_s)
        turned = last.pose.camera_from_body.T @ swing.T @ fit.pose.camera_from_body
        now, before = fit.covariance / dt**2, last.covariance / dt**2
        velocity = end.T @ now[:3, :3] @ end + begin.T @ before[:3, :3] @ begin
        c, d = fit.pose.camera_from_body, last.pose.camera_from_body
        rate = c.T @ now[3:, 3:] @ c + d.T @ before[3:, 3:] @ d
        covariance = bank.covariances[0]
        covariance[VELOCITY, VELOCITY], covariance[RATE, RATE] = velocity, rate
        for part, other, by in ((POSITION, VELOCITY, end), (TURN, RATE, c)):
            covariance[part, other] = fit.covariance[part, part] @ by / dt
            covariance[other, part] = covariance[part, other].T
        bank.states[0, SPEED], bank.states[0, SPIN] = way / dt, rotation_vector(turned) / dt
        return _State(t_s, bank, has_rates=True)

    def _track(
        self, frame: Frame, state: _State, status: Status, reason: Reason, matches: Matches | None = None
    ) -> Track:
        settings = self._settings
        count, residual, pairs = 0, math.nan, None
        if matches is not None:
            sight = sight_of(frame.centres, matches)
            places = predicted_pixels(
                settings.camera, settings.target.points_from_mass_m[matches.point], state.pose
            )
            count, residual = len(matches), math.sqrt(float(np.mean((sight.pixels - places) ** 2)))
            pairs = np.stack((matches.point, matches.centre), axis=1)
        known = state.has_rates
        return Track(
            frame.number,
            frame.t_s,
            status,
            reason,
            state.pose.shifted(-settings.target.offset_m),
            state.bank.covariances[0, :6, :6].copy(),
            state.bank.states[0, SPEED].copy() if known else NOTHING3,
            state.bank.states[0, SPIN].copy() if known else NOTHING3,
            count,
            residual,
            matched=pairs,
        )


def _honest(fit: PoseFit, count: int) -> PoseFit:
    """The pose with a covariance that holds a misfit beyond the noise of its centres, too."""
    misfit = fit.cost / max(1, 2 * count - 6)
    return fit if misfit <= 1.0 else replace(fit, covariance=misfit * fit.covariance)
