"""Frames in, one answer per frame out: matching, solving, and motion between frames."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.aliasing import AliasWatch
from groundstation.relative_navigation.answers import NOTHING3, Reason, Status, Track, lost
from groundstation.relative_navigation.first_poses import Candidate, enough, first_poses
from groundstation.relative_navigation.hypotheses import (
    Hypothesis,
    frame_information,
    others_possible,
    settle,
)
from groundstation.relative_navigation.levenberg import PosePrior
from groundstation.relative_navigation.matching import (
    SHARP_PX,
    Centres,
    Matches,
    match_jointly,
    match_labelled,
    match_near,
)
from groundstation.relative_navigation.motion_bank import FrameInformation
from groundstation.relative_navigation.motion_filter import SURPRISE, MotionFilter
from groundstation.relative_navigation.pixel_equations import jacobian, predicted_pixels
from groundstation.relative_navigation.pose import Pose, PoseFit
from groundstation.relative_navigation.solvers import PoseSolver
from groundstation.relative_navigation.subset_search import GATE, sight_of
from groundstation.relative_navigation.tracker_settings import Frame, TrackerSettings

Floats = NDArray[np.float64]

Solved = tuple[PoseFit, Matches, FrameInformation]
CONTRADICTION = 45.0
"""Squared distance in sigmas of a pose from its prediction at which the frame is solved without it."""
DECIDED_RAD = 0.09
"""A prediction with a turn sigma below this chooses between the two poses of coplanar points."""
FIRST_FRAMES = 4
UNEXPLAINED = 20.0
"""Log of the likelihood that a hypothesis loses where another explains a frame and it does not."""
FRAMES_TO_SEARCH = 1
"""Unsolved frames after which a target is searched for anew."""


class MotionTracker:
    """Follows a target with Hill's and Euler's equations between frames.

    Args:
        settings: The case.
        solver: From centres to a pose.
    """

    def __init__(self, settings: TrackerSettings, solver: PoseSolver) -> None:
        self._settings, self._solver = settings, solver
        self._rng = np.random.default_rng(settings.seed)
        self._alias = AliasWatch(settings.target.inertia_kg_m2)
        self._hypotheses: list[Hypothesis] = []
        self._unsolved = 0
        self._is_aliased = False

    def look(self, frame: Frame) -> Track:
        """Take the next frame; times must grow."""
        if not self._hypotheses:
            return self._begin(frame)
        kept = [self._take(each, frame) for each in self._hypotheses]
        weights = [each[2] for each in kept if each is not None]
        if not weights:
            return self._without(frame)
        self._unsolved = 0
        answers = {}
        for hypothesis, answer in zip(self._hypotheses, kept, strict=True):
            hypothesis.weight += min(weights) - UNEXPLAINED if answer is None else answer[2]
            answers[id(hypothesis)] = answer
        self._hypotheses = settle(self._hypotheses)
        if not self._hypotheses:
            return self._begin(frame)
        best = answers[id(self._hypotheses[0])]
        if best is None:
            return self._propagated(frame, Reason.NO_AGREEMENT)
        fit, matches, _ = best
        return self._answer(frame, fit, matches)

    def _take(self, hypothesis: Hypothesis, frame: Frame) -> tuple[PoseFit, Matches, float] | None:
        """Give a frame to one hypothesis: pose, pairs and log likelihood; None if it explains nothing."""
        motion = hypothesis.motion
        motion.predict(frame.t_s)
        if not motion.is_sound():
            return None
        pose, covariance = motion.prior
        found = self._solved(frame.centres, pose, covariance)
        if found is None:
            return None
        fit, matches, information = found
        off = fit.pose.minus(pose)
        if float(off @ np.linalg.solve(covariance, off)) > SURPRISE:
            motion.reopen(fit.pose)
        return fit, matches, motion.update(information) + self._match_weight(matches, frame.centres)

    def _match_weight(self, matches: Matches, centres: Centres) -> float:
        """Log of the likelihood that other points are missing and other centres are strays."""
        if centres.points is not None:
            return 0.0
        area = float(self._settings.camera.width_px * self._settings.camera.height_px)
        size = np.linalg.det(centres.covariances[matches.centre])
        return float(len(matches) * math.log(area) - np.log(2.0 * np.pi * np.sqrt(size)).sum())

    def _solved(self, centres: Centres, pose: Pose, covariance: Floats) -> Solved | None:
        settings = self._settings
        prior = PosePrior(pose, np.linalg.inv(covariance).astype(np.float64, copy=False))
        if centres.points is not None:
            matches = match_labelled(centres, len(settings.target))
            return self._fitted(centres, matches, pose, prior)
        for start, matches in self._pairings(centres, pose, covariance):
            found = self._fitted(centres, matches, start, prior)
            if found is not None:
                return self._rematched(centres, found, prior)
        return None

    def _pairings(self, centres: Centres, pose: Pose, covariance: Floats) -> list[tuple[Pose, Matches]]:
        camera, points = self._settings.camera, self._settings.target.points_from_mass_m
        if not len(centres):
            return []
        predicted = predicted_pixels(camera, points, pose)
        rows = jacobian(camera, points, pose)
        spreads = rows @ covariance @ rows.transpose(0, 2, 1)
        reach = self._settings.reach_px
        if reach is not None or float(spreads[:, range(2), range(2)].max()) < SHARP_PX**2:
            near = match_near(predicted, spreads, centres, reach)
            if reach is not None or len(near) >= len(points) - 2:
                return [(pose, near)]
        return match_jointly(camera, points, centres, pose, covariance)

    def _fitted(self, centres: Centres, matches: Matches, start: Pose, prior: PosePrior) -> Solved | None:
        settings = self._settings
        if not (enough(matches, settings.target) or _is_decided(matches, prior)):
            return None
        sight = sight_of(centres, matches)
        points = settings.target.points_from_mass_m
        fit = self._solver(settings.camera, points, sight, start, prior)
        off = fit.pose.minus(prior.mean)
        if fit.converged and float(off @ prior.information @ off) > CONTRADICTION:
            alone = self._solver(settings.camera, points, sight, fit.pose, None)
            if alone.converged:
                fit = alone
        if not fit.converged:
            return None
        information = frame_information(settings.camera, points, sight, fit.pose)
        if information is None or information.cost > GATE * len(matches):
            return None
        return fit, matches, information

    def _rematched(self, centres: Centres, found: Solved, prior: PosePrior) -> Solved:
        """Take in centres that the pose explains now, and leave out those that it does not."""
        settings = self._settings
        fit, matches, information = found
        if len(matches) == len(settings.target) and information.cost < 5.0 * len(matches):
            return found
        points = settings.target.points_from_mass_m
        rows = jacobian(settings.camera, points, fit.pose)
        spreads = rows @ fit.covariance @ rows.transpose(0, 2, 1)
        again = match_near(predicted_pixels(settings.camera, points, fit.pose), spreads, centres)
        if np.array_equal(again.point, matches.point) and np.array_equal(again.centre, matches.centre):
            return found
        better = self._fitted(centres, again, fit.pose, prior)
        return found if better is None else better

    def _begin(self, frame: Frame) -> Track:
        candidates = first_poses(frame.centres, self._settings, self._rng)
        if not candidates:
            return lost(frame.number, frame.t_s, self._why(frame.centres))
        self._start(candidates, frame)
        return self._answer(frame, candidates[0].fit, candidates[0].matches)

    def _start(self, candidates: list[Candidate], frame: Frame) -> None:
        settings = self._settings
        self._hypotheses = settle(
            [
                Hypothesis(
                    MotionFilter(
                        settings.craft,
                        settings.target.inertia_kg_m2,
                        frame.t_s,
                        each.fit.pose,
                        each.fit.covariance,
                    ),
                    each.weight,
                )
                for each in candidates
            ]
        )
        self._alias.forget()
        self._is_aliased = False
        self._unsolved = 0

    def _why(self, centres: Centres) -> Reason:
        if not len(centres):
            return Reason.NO_POINTS
        if centres.points is not None:
            matches = match_labelled(centres, len(self._settings.target))
            if enough(matches, self._settings.target):
                return Reason.NO_AGREEMENT
            return Reason.TOO_FEW_POINTS
        return Reason.TOO_FEW_POINTS if len(centres) < 4 else Reason.NO_AGREEMENT

    def _without(self, frame: Frame) -> Track:
        """No hypothesis explains the frame: search anew, or go on by motion alone."""
        self._unsolved += 1
        if self._unsolved > FRAMES_TO_SEARCH:
            found = self._found_again(frame)
            if found is not None:
                return found
        return self._propagated(frame, self._why(frame.centres))

    def _found_again(self, frame: Frame) -> Track | None:
        candidates = first_poses(frame.centres, self._settings, self._rng)
        if not candidates:
            return None
        pose, covariance = self._hypotheses[0].motion.prior
        information = np.linalg.inv(covariance)

        def distance(each: Candidate) -> float:
            off = each.fit.pose.minus(pose)
            return float(off @ information @ off)

        nearest = min(candidates, key=distance)
        if distance(nearest) < CONTRADICTION:
            sight = sight_of(frame.centres, nearest.matches)
            points = self._settings.target.points_from_mass_m
            said = frame_information(self._settings.camera, points, sight, nearest.fit.pose)
            if said is not None:
                self._hypotheses[0].motion.update(said)
                self._unsolved = 0
                return self._answer(frame, nearest.fit, nearest.matches)
        self._start(candidates, frame)
        return self._answer(frame, candidates[0].fit, candidates[0].matches)

    def _propagated(self, frame: Frame, reason: Reason) -> Track:
        if not self._hypotheses[0].motion.is_sound():
            self._hypotheses = []
            return lost(frame.number, frame.t_s, reason)
        estimate = self._hypotheses[0].motion.estimate
        pose, covariance = self._origin(estimate.pose, estimate.covariance[:6, :6])
        return Track(
            frame.number,
            frame.t_s,
            Status.PROPAGATED,
            reason,
            pose,
            covariance,
            estimate.velocity_m_s,
            NOTHING3 if self._is_aliased else estimate.rate_rad_s,
            others=others_possible(self._hypotheses),
        )

    def _answer(self, frame: Frame, fit: PoseFit, matches: Matches) -> Track:
        motion = self._hypotheses[0].motion
        estimate = motion.estimate
        self._watch(frame, fit)
        if self._is_aliased or self._has_lost_its_way(estimate.pose, fit):
            motion = self._anew(frame, fit)
            estimate = motion.estimate
        status, reason = Status.SOLVED, Reason.NONE
        pose, covariance = estimate.pose, estimate.covariance[:6, :6]
        velocity, rate = estimate.velocity_m_s, estimate.rate_rad_s
        if motion.frames == 1:
            velocity = rate = NOTHING3
        others = others_possible(self._hypotheses)
        if others:
            status, reason = Status.AMBIGUOUS, Reason.SEVERAL_POSES
        elif self._is_aliased:
            status, reason = Status.ALIASED, Reason.TOO_FAST
            rate = NOTHING3
        elif motion.is_contradicted:
            reason = Reason.CONTRADICTED
        pose, covariance = self._origin(pose, covariance)
        sight = sight_of(frame.centres, matches)
        off = sight.pixels - predicted_pixels(
            self._settings.camera, self._settings.target.points_body_m[matches.point], pose
        )
        return Track(
            frame.number,
            frame.t_s,
            status,
            reason,
            pose,
            covariance,
            velocity,
            rate,
            len(matches),
            math.sqrt(float(np.mean(off * off))),
            tuple(self._origin(each, covariance)[0] for each in others),
            np.stack((matches.point, matches.centre), axis=1),
        )

    def _has_lost_its_way(self, pose: Pose, fit: PoseFit) -> bool:
        """Whether the first frames turned so far that the filter's series of small turns did not hold."""
        if not 1 < self._hypotheses[0].motion.frames <= FIRST_FRAMES or not math.isfinite(
            fit.covariance[0, 0]
        ):
            return False
        off = pose.minus(fit.pose)
        return float(off @ np.linalg.solve(fit.covariance, off)) > CONTRADICTION

    def _anew(self, frame: Frame, fit: PoseFit) -> MotionFilter:
        """Begin the likeliest hypothesis again with the frame's own pose."""
        craft, inertia = self._settings.craft, self._settings.target.inertia_kg_m2
        self._hypotheses[0].motion = MotionFilter(craft, inertia, frame.t_s, fit.pose, fit.covariance)
        return self._hypotheses[0].motion

    def _watch(self, frame: Frame, fit: PoseFit) -> None:
        """Look at the first frames, whether the target turns too fast for them."""
        if len(self._hypotheses) > 1:  # the likeliest may change from frame to frame
            self._alias.forget()
            self._is_aliased = False
            return
        if self._alias.is_decided and not self._is_aliased:
            return
        inertial_from_camera = self._settings.craft.turned_by(0.0, frame.t_s).T
        sigma = math.sqrt(max(0.0, float(np.trace(fit.covariance[3:, 3:]))))
        self._alias.note(frame.t_s, inertial_from_camera @ fit.pose.camera_from_body, sigma)
        self._is_aliased = self._alias.is_aliased()

    def _origin(self, pose: Pose, covariance: Floats) -> tuple[Pose, Floats]:
        """Pose and covariance of the body's origin from those of its centre of mass."""
        offset = self._settings.target.offset_m
        if not offset.any():
            return pose, covariance
        arm = pose.camera_from_body @ offset
        x, y, z = arm.tolist()
        by = np.eye(6)
        by[:3, 3:] = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]  # -(turn x arm) = arm x turn
        return pose.shifted(-offset), by @ covariance @ by.T


def _is_decided(matches: Matches, prior: PosePrior) -> bool:
    """Whether four coplanar points are enough because motion tells their two poses apart."""
    if len(matches) < 4:
        return False
    turn = np.linalg.inv(prior.information)[3:, 3:]
    return bool(np.trace(turn) < DECIDED_RAD**2)
