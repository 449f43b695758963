"""A target found from nothing: three centres taken as three points give poses, the others judge.

Triples of well-spread points are tried with every triple of centres, all at once. A pose that explains five
centres, or all of a smaller target's, is no chance; several such poses, as of a symmetric body, are all
given back.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.levenberg import solve_levenberg
from groundstation.relative_navigation.matching import Centres, Matches, match_near
from groundstation.relative_navigation.pinhole import PinholeCamera
from groundstation.relative_navigation.pixel_equations import jacobian, predicted_pixels
from groundstation.relative_navigation.pose import Pose, PoseFit, Sight
from groundstation.relative_navigation.rotations import angle_between
from groundstation.relative_navigation.target import Target
from groundstation.relative_navigation.three_points import poses_of_triples

Floats = NDArray[np.float64]

MOST_TRIPLES = 12000
"""Of point and centre triples; beyond, they are drawn at random."""
TRIED = 40
"""Poses that are refined."""
LEAST_WITNESSES = 5
_REACH_SIGMAS, _REACH_PX = 6.0, 1.5
"""How near a centre must be to count for a pose that rests on three: noise of the three is carried far."""
APART_RAD, APART_SHARE = 0.09, 0.03
"""Poses nearer to each other are one."""
GATE = 16.0
"""Of a squared residual, in sigmas."""


@dataclass(frozen=True, slots=True, eq=False)
class Discovery:
    """A pose found from nothing.

    Attributes:
        fit: Refined.
        matches: Points and centres that it rests on.
        score: Log of likelihood over chance.
    """

    fit: PoseFit
    matches: Matches
    score: float


def search(
    camera: PinholeCamera,
    target: Target,
    centres: Centres,
    rng: np.random.Generator,
    least_witnesses: int = LEAST_WITNESSES,
) -> list[Discovery]:
    """Return the poses of the centre of mass that explain a frame, the best first.

    Args:
        camera: The camera.
        target: What is looked for.
        centres: Of the frame, unlabelled.
        rng: Draws triples where there are too many.
        least_witnesses: How many centres a pose must explain; of a smaller target, all points.

    Returns:
        Poses whose score is within twelve of the best; none if nothing convinces.
    """
    points = target.points_from_mass_m
    need = max(4, min(least_witnesses, len(target)))
    if len(centres) < need:
        return []
    triples = _point_triples(points)
    rows = np.array(list(itertools.permutations(range(len(centres)), 3))) if len(centres) <= 24 else None
    if rows is None:
        rows = np.argsort(rng.random((MOST_TRIPLES, len(centres))), axis=1)[:, :3]
    pair = np.stack(np.meshgrid(range(len(triples)), range(len(rows)), indexing="ij"), axis=-1).reshape(-1, 2)
    if len(pair) > MOST_TRIPLES:
        pair = pair[rng.choice(len(pair), MOST_TRIPLES, replace=False)]
    rotation, position, _ = poses_of_triples(
        points[triples[pair[:, 0]]], camera.rays(centres.pixels)[rows[pair[:, 1]]]
    )
    if not len(rotation):
        return []
    support = _support(camera, points, centres, rotation, position)
    found: list[Discovery] = []
    for pick in np.argsort(-support)[:TRIED]:
        if support[pick] < need - 2.5:
            break
        each = refine(camera, points, centres, Pose(rotation[pick], position[pick]))
        if each is None or len(each.matches) < need or not _is_new(each, found):
            continue
        found.append(each)
    found.sort(key=lambda each: -each.score)
    return [each for each in found if each.score > max(0.0, found[0].score - 12.0)]


def refine(camera: PinholeCamera, points: Floats, centres: Centres, pose: Pose) -> Discovery | None:
    """Return a rough pose refined on whatever centres agree with it; None if it falls apart."""
    sigma = float(np.sqrt(centres.covariances[:, 0, 0].mean()))
    reach = _REACH_SIGMAS * sigma + 4.0 * _REACH_PX
    fit, matches = None, None
    for last in (False, False, True):
        predicted = predicted_pixels(camera, points, pose)
        if last and fit is not None and fit.converged:
            rows = jacobian(camera, points, pose)
            spreads = rows @ fit.covariance @ rows.transpose(0, 2, 1)
            found = match_near(predicted, spreads, centres)
        else:
            found = match_near(predicted, np.zeros((len(points), 2, 2)), centres, reach)
            reach = _REACH_SIGMAS * sigma + _REACH_PX
        if len(found) < 4:
            return None
        if matches is not None and fit is not None and _same(found, matches):
            break
        matches = found
        fit = solve_levenberg(camera, points, sight_of(centres, matches), pose)
        if not fit.converged:
            return None
        pose = fit.pose
    if fit is None or matches is None or fit.cost > GATE * len(matches):
        return None
    return Discovery(fit, matches, _score(camera, len(points), centres, matches, fit))


def sight_of(centres: Centres, matches: Matches) -> Sight:
    """Return matched centres as solvers take them."""
    pixels = centres.pixels[matches.centre]
    if centres.sigma_px is not None:
        return Sight(matches.point, pixels, 1.0 / centres.sigma_px)
    covariances = centres.covariances[matches.centre]
    a, b, d = covariances[:, 0, 0], covariances[:, 0, 1], covariances[:, 1, 1]
    weights = np.zeros_like(covariances)  # inverse of the lower Cholesky factor
    root = np.sqrt(a)
    rest = np.sqrt(d - b * b / a)
    weights[:, 0, 0] = 1.0 / root
    weights[:, 1, 1] = 1.0 / rest
    weights[:, 1, 0] = -b / (a * rest)
    return Sight(matches.point, pixels, weights)


def _score(camera: PinholeCamera, count: int, centres: Centres, matches: Matches, fit: PoseFit) -> float:
    area = float(camera.width_px * camera.height_px)
    strays = max(1.0, len(centres) - len(matches) + 0.5)
    size = np.sqrt(np.linalg.det(centres.covariances[matches.centre]))
    likelihood = -np.log(2.0 * np.pi * size).sum() - 0.5 * fit.cost
    chance = len(matches) * float(np.log(strays / area))
    missed = (count - len(matches)) * float(np.log(0.1))
    freedom = 3.0 * float(np.log(area))  # six numbers were fitted: three centres would have fitted anyway
    return float(likelihood - chance + missed - freedom)


def _point_triples(points: Floats) -> NDArray[np.int64]:
    """Triples of points by the area that they span, widest first; a few of them are enough."""
    every = np.array(list(itertools.combinations(range(len(points)), 3)), dtype=np.int64)
    sides = points[every]
    area = np.linalg.norm(np.cross(sides[:, 1] - sides[:, 0], sides[:, 2] - sides[:, 0]), axis=1)
    order = np.argsort(-area)
    good: NDArray[np.int64] = every[order[area[order] > 0.05 * area.max()]]
    return good[: max(20, 2 * len(points))]


def _support(
    camera: PinholeCamera, points: Floats, centres: Centres, rotation: Floats, position: Floats
) -> Floats:
    """How many centres each pose explains, near ones in full."""
    x = points @ rotation.transpose(0, 2, 1) + position[:, None]
    depth = x[:, :, 2]
    places = camera.project(np.where(depth[:, :, None] > 1e-3, x, 1.0))
    off = places[:, :, None] - centres.pixels[None, None]
    square = np.einsum("mnki,mnki->mnk", off, off).min(axis=2)
    sigma = float(np.sqrt(centres.covariances[:, 0, 0].mean()))
    reach = _REACH_SIGMAS * sigma + _REACH_PX
    gains: Floats = np.where(depth > 1e-3, np.maximum(0.0, 1.0 - square / (4.0 * reach**2)), 0.0).sum(axis=1)
    return gains


def _same(one: Matches, other: Matches) -> bool:
    return np.array_equal(one.point, other.point) and np.array_equal(one.centre, other.centre)


def _is_new(each: Discovery, found: list[Discovery]) -> bool:
    pose = each.fit.pose
    return not any(
        angle_between(pose.camera_from_body, other.fit.pose.camera_from_body) < APART_RAD
        and float(np.linalg.norm(pose.position_camera_m - other.fit.pose.position_camera_m))
        < APART_SHARE * float(np.linalg.norm(pose.position_camera_m))
        for other in found
    )
