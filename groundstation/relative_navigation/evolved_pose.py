"""The published search of a pose by differential evolution: the position follows from the turn.

Simakov, Ustyugov 2016: unknown are the parameters of orientation; the position comes from analytic relations
between pixels and centre of mass, which are not given: here least squares, linear once the turn is fixed. The
box of the search lies around the prediction of the motion model.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.evolution import EvolutionSettings, Evolved, evolve
from groundstation.relative_navigation.levenberg import PosePrior
from groundstation.relative_navigation.pinhole import PinholeCamera
from groundstation.relative_navigation.pixel_equations import NEAREST_M, whitened
from groundstation.relative_navigation.pose import Pose, PoseFit, Sight
from groundstation.relative_navigation.rotations import turn, turns

Floats = NDArray[np.float64]

WIDEST_RAD = 0.6
"""Half a side of the box where no covariance narrows it."""
_NARROWEST_RAD = 0.02
_SIGMAS = 4.0


@dataclass
class EvolvedPose:
    """A solver that searches by differential evolution.

    Attributes:
        settings: Of the search.
        rng: Its randomness.
        spent: Evaluations of the last search.
    """

    settings: EvolutionSettings = field(default_factory=EvolutionSettings)
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))
    spent: int = 0

    def __call__(
        self,
        camera: PinholeCamera,
        points_body_m: Floats,
        sight: Sight,
        start: Pose,
        prior: PosePrior | None = None,
    ) -> PoseFit:
        """Return the best pose in the box around a prediction; arguments as for `levenberg`."""
        points = points_body_m[sight.point]
        half = _half_sides_rad(prior)
        found = search(camera, points, sight.pixels, start.camera_from_body, half, self.settings, self.rng)
        self.spent = found.evaluations
        rotation = turn(found.parameters) @ start.camera_from_body
        pose = Pose(rotation, _positions(camera, points, sight.pixels, rotation[None])[0])
        pair = whitened(camera, points, sight, pose)
        if pair is None:
            return PoseFit(start, np.full((6, 6), np.nan), float("inf"), found.generations, converged=False)
        off, rows = pair
        try:
            covariance = np.linalg.inv(rows.T @ rows).astype(np.float64, copy=False)
        except np.linalg.LinAlgError:
            return PoseFit(start, np.full((6, 6), np.nan), float("inf"), found.generations, converged=False)
        return PoseFit(pose, covariance, float(off @ off), found.generations, converged=True)


def search(
    camera: PinholeCamera,
    points: Floats,
    pixels: Floats,
    around: Floats,
    half_sides_rad: Floats,
    settings: EvolutionSettings,
    rng: np.random.Generator,
) -> Evolved:
    """Evolve the rotation vector (3,), about camera axes, in front of a predicted rotation.

    Args:
        camera: The camera.
        points: Seen points in body axes, (k, 3).
        pixels: Where they were seen, (k, 2).
        around: The prediction, (3, 3).
        half_sides_rad: Of the box, (3,).
        settings: Of the search.
        rng: Randomness.
    """

    def cost(vectors: Floats) -> Floats:
        return pixel_costs(camera, points, pixels, turns(vectors) @ around)

    return evolve(cost, -half_sides_rad, half_sides_rad, settings, rng)


def pixel_costs(camera: PinholeCamera, points: Floats, pixels: Floats, rotations: Floats) -> Floats:
    """Return sums of squares in px^2 of rotations (n, 3, 3), each with its best position."""
    r = points @ rotations.transpose(0, 2, 1)
    x = r + _positions_from(camera, r, pixels)[:, None]
    front = x[:, :, 2].min(axis=1) > NEAREST_M
    depth = np.where(x[:, :, 2] > NEAREST_M, x[:, :, 2], 1.0)
    off = camera.f_px * x[:, :, :2] / depth[:, :, None]
    off += np.array((camera.cx_px, camera.cy_px)) - pixels
    sums: Floats = np.einsum("nki,nki->n", off, off)
    return np.where(front, sums, 1e12)


def _positions(camera: PinholeCamera, points: Floats, pixels: Floats, rotations: Floats) -> Floats:
    return _positions_from(camera, points @ rotations.transpose(0, 2, 1), pixels)


def _positions_from(camera: PinholeCamera, r: Floats, pixels: Floats) -> Floats:
    """Positions (n, 3) of least squares: twice in units of length, the second time weighted to pixels.

    For turned points R (n, k, 3): ``(R + t)_xy = w (R + t)_z`` with ``w = (pixel - c) / f``. The rows
    ``[1 0 -w]`` are the same for every rotation, so without weights one (3, 3) inverse serves all.
    """
    w = (pixels - (camera.cx_px, camera.cy_px)) / camera.f_px
    b = w[None] * r[:, :, 2:] - r[:, :, :2]
    count = len(w)
    middle = w.sum(axis=0)
    a = np.array(
        [
            [count, 0.0, -middle[0]],
            [0.0, count, -middle[1]],
            [-middle[0], -middle[1], float(np.einsum("ki,ki->", w, w))],
        ]
    )
    right = np.concatenate((b.sum(axis=1), -np.einsum("ki,nki->n", w, b)[:, None]), axis=1)
    t = np.linalg.solve(a, right.T).T
    depth = r[:, :, 2] + t[:, None, 2]
    weight = 1.0 / np.square(np.where(depth > NEAREST_M, depth, 1e6))
    ww = weight @ w  # (n, 2)
    total = weight.sum(axis=1)
    square = weight @ np.einsum("ki,ki->k", w, w)
    wb = np.einsum("nk,nki->ni", weight, b)
    last = -np.einsum("nk,ki,nki->n", weight, w, b)
    # the normal equations [[s I, -m], [-m', q]] by elimination of x and y
    bottom = square - np.einsum("ni,ni->n", ww, ww) / total
    z = (last + np.einsum("ni,ni->n", ww, wb) / total) / bottom
    xy = (wb + ww * z[:, None]) / total[:, None]
    return np.concatenate((xy, z[:, None]), axis=1)


def _half_sides_rad(prior: PosePrior | None) -> Floats:
    if prior is None:
        return np.full(3, WIDEST_RAD)
    covariance = np.linalg.inv(prior.information)
    return np.clip(_SIGMAS * np.sqrt(np.diag(covariance)[3:]), _NARROWEST_RAD, WIDEST_RAD)
