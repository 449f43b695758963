"""Poses of a frame that nothing is known before, or only a rough guess; all that fit are given."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.levenberg import solve_levenberg
from groundstation.relative_navigation.matching import Centres, Matches, match_jointly, match_labelled
from groundstation.relative_navigation.pinhole import PinholeCamera
from groundstation.relative_navigation.planar_twin import twin_of
from groundstation.relative_navigation.pose import Pose, PoseFit, Sight
from groundstation.relative_navigation.rotations import angle_between, turn
from groundstation.relative_navigation.subset_search import GATE, Discovery, refine, search, sight_of
from groundstation.relative_navigation.target import Target
from groundstation.relative_navigation.tracker_settings import TrackerSettings

Floats = NDArray[np.float64]

SAME_RAD = 0.05
UNLIKELY = 10.0
"""A pose whose log likelihood is this far below the best is left out."""
_LEAST_MATCHES = 4


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A pose of the centre of mass that fits a frame.

    Attributes:
        fit: The pose.
        matches: What it rests on.
        weight: Log of how likely it is, the guess included.
    """

    fit: PoseFit
    matches: Matches
    weight: float


def first_poses(centres: Centres, settings: TrackerSettings, rng: np.random.Generator) -> list[Candidate]:
    """Return the poses that fit a frame, the likeliest first; none if it does not show enough."""
    if centres.points is not None:
        found = _labelled(centres, settings)
    else:
        found = _unlabelled(centres, settings, rng)
    if not found:
        return []
    found.sort(key=lambda each: -each.weight)
    return [each for each in found if each.weight > found[0].weight - UNLIKELY]


def enough(matches: Matches, target: Target) -> bool:
    """Whether points determine a pose: four that span space, or four of a target that lies in a plane."""
    if len(matches) < _LEAST_MATCHES:
        return False
    return target.is_planar or not target.are_coplanar(matches.point)


def best_of(camera: PinholeCamera, target: Target, sight: Sight, starts: list[Pose]) -> list[PoseFit]:
    """Return the different rests that starts lead to, cheapest first; with twins of coplanar points."""
    points = target.points_from_mass_m
    fits: list[PoseFit] = []
    for start in starts:
        fit = solve_levenberg(camera, points, sight, start)
        _keep(fit, fits)
        if fit.converged and target.are_coplanar(sight.point):
            chosen = points[sight.point]
            normal = np.linalg.svd(chosen - chosen.mean(axis=0))[2][2]
            _keep(solve_levenberg(camera, points, sight, twin_of(fit.pose, chosen, normal)), fits)
    return sorted(fits, key=lambda each: each.cost)


def _keep(fit: PoseFit, fits: list[PoseFit]) -> None:
    if fit.converged and all(
        angle_between(fit.pose.camera_from_body, each.pose.camera_from_body) > SAME_RAD for each in fits
    ):
        fits.append(fit)


def cold_starts(camera: PinholeCamera, target: Target, sight: Sight) -> list[Pose]:
    """Return poses of labelled points without any guess, by OpenCV's SQPNP."""
    points = np.ascontiguousarray(target.points_from_mass_m[sight.point])
    matrix = np.array([[camera.f_px, 0.0, camera.cx_px], [0.0, camera.f_px, camera.cy_px], [0.0, 0.0, 1.0]])
    try:
        count, turns, places, _ = cv2.solvePnPGeneric(
            points, np.ascontiguousarray(sight.pixels), matrix, None, flags=cv2.SOLVEPNP_SQPNP
        )
    except cv2.error:
        return []
    found = [
        Pose(turn(np.asarray(turns[i], np.float64).ravel()), np.asarray(places[i], np.float64).ravel())
        for i in range(count)
    ]
    return [
        pose
        for pose in found
        if np.all(np.isfinite(pose.position_camera_m))
        and float(pose.points_camera_m(points)[:, 2].min()) > 0.0
    ]


def _labelled(centres: Centres, settings: TrackerSettings) -> list[Candidate]:
    matches = match_labelled(centres, len(settings.target))
    if not enough(matches, settings.target):
        return []
    sight = sight_of(centres, matches)
    guess = settings.guess_of_mass
    starts = cold_starts(settings.camera, settings.target, sight)
    if guess is not None:
        starts.insert(0, guess)
    return [
        Candidate(fit, matches, -0.5 * fit.cost + _belief(fit.pose, settings))
        for fit in best_of(settings.camera, settings.target, sight, starts)
        if fit.cost < GATE * len(matches)
    ]


def _unlabelled(centres: Centres, settings: TrackerSettings, rng: np.random.Generator) -> list[Candidate]:
    target, camera, guess = settings.target, settings.camera, settings.guess_of_mass
    found: list[Discovery] = []
    if guess is not None:
        tried = match_jointly(camera, target.points_from_mass_m, centres, guess, settings.guess_covariance())
        refined = [refine(camera, target.points_from_mass_m, centres, pose) for pose, _ in tried]
        found = [each for each in refined if each is not None and enough(each.matches, target)]
    if not any(len(each.matches) >= min(5, len(target)) for each in found):
        found += search(camera, target, centres, rng)
    return [
        Candidate(each.fit, each.matches, each.score + _belief(each.fit.pose, settings))
        for each in _different(found)
    ]


def _different(found: list[Discovery]) -> list[Discovery]:
    kept: list[Discovery] = []
    for each in sorted(found, key=lambda one: -one.score):
        if all(
            angle_between(each.fit.pose.camera_from_body, other.fit.pose.camera_from_body) > SAME_RAD
            for other in kept
        ):
            kept.append(each)
    return kept


def _belief(pose: Pose, settings: TrackerSettings) -> float:
    """Log of how far the guess believes a pose, never worse than a plain stranger."""
    guess = settings.guess_of_mass
    if guess is None:
        return 0.0
    off = pose.minus(guess)
    square = float(off @ np.linalg.solve(settings.guess_covariance(), off))
    return max(-0.5 * square, -50.0 - math.log1p(square))
