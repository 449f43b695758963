"""Each frame solved by itself, the last solution being where the search begins: no motion model.

As published but for the prediction; where a frame does not show enough the last pose is kept, with a sigma
that grows as if the target went on unseen.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.answers import NOTHING3, Reason, Status, Track, lost
from groundstation.relative_navigation.first_poses import Candidate, enough, first_poses
from groundstation.relative_navigation.matching import (
    Centres,
    Matches,
    match_jointly,
    match_labelled,
    match_near,
)
from groundstation.relative_navigation.pixel_equations import predicted_pixels
from groundstation.relative_navigation.pose import Pose, PoseFit
from groundstation.relative_navigation.rotations import rotation_vector
from groundstation.relative_navigation.solvers import PoseSolver
from groundstation.relative_navigation.subset_search import sight_of
from groundstation.relative_navigation.tracker_settings import Frame, TrackerSettings

Floats = NDArray[np.float64]

NEAR_PX = 12.0
"""Neighbourhood of a point's last place where no epsilon is given."""
STRAY_TURN_RAD, STRAY_SHARE = 0.12, 0.05
"""How far a target may have turned and moved, as a share of its distance, since the last frame, one sigma."""
MOST_COST = 8.0
"""Sum of squares for each centre, in sigmas, beyond which centres were taken for the wrong points."""
STRAY_TURN_RAD_S, STRAY_SHARE_S = 0.02, 0.01
"""How fast an unseen target is taken to turn, and to move as a share of its distance, one sigma."""


class SingleFrames:
    """Solves frames one by one.

    Args:
        settings: The case.
        solver: From centres to a pose.
    """

    def __init__(self, settings: TrackerSettings, solver: PoseSolver) -> None:
        self._settings, self._solver = settings, solver
        self._rng = np.random.default_rng(settings.seed)
        self._last: tuple[float, PoseFit] | None = None
        self._rate = NOTHING3

    def look(self, frame: Frame) -> Track:
        """Take the next frame; times must grow."""
        found: tuple[PoseFit, Matches] | None = None
        others: tuple[Pose, ...] = ()
        if self._last is not None:
            found = self._from_last(frame.centres, self._last[1])
        if found is None:
            candidates = first_poses(frame.centres, self._settings, self._rng)
            if candidates:
                found = self._polished(frame.centres, self._nearest(candidates))
                others = tuple(
                    each.fit.pose.shifted(-self._settings.target.offset_m)
                    for each in candidates
                    if each.fit is not found[0] and self._last is None and each is not candidates[0]
                )
        if found is None:
            return self._kept(frame)
        fit, matches = found
        self._differentiate(frame.t_s, fit)
        self._last = (frame.t_s, fit)
        offset = self._settings.target.offset_m
        sight = sight_of(frame.centres, matches)
        places = predicted_pixels(
            self._settings.camera, self._settings.target.points_from_mass_m[matches.point], fit.pose
        )
        return Track(
            frame.number,
            frame.t_s,
            Status.AMBIGUOUS if others else Status.SOLVED,
            Reason.SEVERAL_POSES if others else Reason.NONE,
            fit.pose.shifted(-offset),
            fit.covariance,
            NOTHING3,
            self._rate,
            len(matches),
            math.sqrt(float(np.mean((sight.pixels - places) ** 2))),
            others,
            np.stack((matches.point, matches.centre), axis=1),
        )

    def _from_last(self, centres: Centres, last: PoseFit) -> tuple[PoseFit, Matches] | None:
        settings = self._settings
        points, count = settings.target.points_from_mass_m, len(settings.target)
        if centres.points is not None:
            return self._fitted(centres, match_labelled(centres, count), last.pose)
        if not len(centres):
            return None
        reach = NEAR_PX if settings.reach_px is None else settings.reach_px
        predicted = predicted_pixels(settings.camera, points, last.pose)
        near = match_near(predicted, np.broadcast_to(reach**2 * np.eye(2), (count, 2, 2)), centres, reach)
        found = self._fitted(centres, near, last.pose)
        if found is not None or settings.reach_px is not None:
            return found
        share = STRAY_SHARE * float(np.linalg.norm(last.pose.position_camera_m))
        wide = np.diag([share**2] * 3 + [STRAY_TURN_RAD**2] * 3)
        for pose, matches in match_jointly(settings.camera, points, centres, last.pose, wide):
            found = self._fitted(centres, matches, pose)
            if found is not None:
                return found
        return None

    def _fitted(self, centres: Centres, matches: Matches, start: Pose) -> tuple[PoseFit, Matches] | None:
        settings = self._settings
        if not enough(matches, settings.target):
            return None
        points = settings.target.points_from_mass_m
        fit = self._solver(settings.camera, points, sight_of(centres, matches), start, None)
        if not fit.converged or fit.cost > MOST_COST * len(matches):
            return None
        return fit, matches

    def _polished(self, centres: Centres, candidate: Candidate) -> tuple[PoseFit, Matches]:
        """The candidate by the solver that was asked for."""
        sight = sight_of(centres, candidate.matches)
        points = self._settings.target.points_from_mass_m
        fit = self._solver(self._settings.camera, points, sight, candidate.fit.pose, None)
        return (fit if fit.converged else candidate.fit), candidate.matches

    def _nearest(self, candidates: list[Candidate]) -> Candidate:
        if self._last is None:
            return candidates[0]
        last = self._last[1].pose
        return min(candidates, key=lambda each: float(np.linalg.norm(each.fit.pose.minus(last)[3:])))

    def _differentiate(self, t_s: float, fit: PoseFit) -> None:
        """Rates by differences of poses, as published."""
        if self._last is None or t_s <= self._last[0]:
            return
        begin, last = self._last
        turn = last.pose.camera_from_body.T @ fit.pose.camera_from_body
        self._rate = rotation_vector(turn) / (t_s - begin)

    def _kept(self, frame: Frame) -> Track:
        settings = self._settings
        reason = Reason.NO_POINTS if not len(frame.centres) else Reason.TOO_FEW_POINTS
        if frame.centres.points is None and len(frame.centres) >= 4:
            reason = Reason.NO_AGREEMENT
        if self._last is None:
            return lost(frame.number, frame.t_s, reason)
        begin, last = self._last
        age = frame.t_s - begin
        pose: Pose = last.pose.shifted(-settings.target.offset_m)
        reach = STRAY_SHARE_S * float(np.linalg.norm(pose.position_camera_m)) * age
        covariance = last.covariance + np.diag([reach**2] * 3 + [(STRAY_TURN_RAD_S * age) ** 2] * 3)
        return Track(
            frame.number, frame.t_s, Status.PROPAGATED, reason, pose, covariance, NOTHING3, self._rate
        )
