"""The pose of least squares in NumPy: what ``groundstation/core/pose.c`` must agree with, step by step."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.levenberg import (
    _MOST_INFLATION,
    FIRST_DAMPING,
    MOST_DAMPING,
    MOST_ITERATIONS,
    REST,
    PosePrior,
)
from groundstation.relative_navigation.pinhole import PinholeCamera
from groundstation.relative_navigation.pixel_equations import whitened
from groundstation.relative_navigation.pose import Pose, PoseFit, Sight

Floats = NDArray[np.float64]


def solve_levenberg(
    camera: PinholeCamera,
    points_body_m: Floats,
    sight: Sight,
    start: Pose,
    prior: PosePrior | None = None,
) -> PoseFit:
    """Return the pose of least squares near a start.

    Args:
        camera: The camera.
        points_body_m: All points of the target, (n, 3).
        sight: Which of them were seen, and where.
        start: Where the search begins; all points must lie in front of the camera.
        prior: What is known beside the frame.

    Returns:
        The fit; ``converged`` is false where it did not come to rest, or where the frame leaves a direction
        of the pose unknown.
    """
    points = points_body_m[sight.point]
    pose, damping = start, 0.0
    found = whitened(camera, points, sight, pose)
    if found is None:
        return _nothing(start)
    off, rows = found
    cost = float(off @ off) + _prior_cost(prior, pose)
    for iteration in range(1, MOST_ITERATIONS + 1):
        normal, gradient = rows.T @ rows, off @ rows
        if prior is not None:
            normal += prior.information
            gradient += prior.information @ prior.mean.minus(pose)
        step = _step(normal, gradient, damping)
        if step is None:
            return _nothing(pose)
        if damping == 0.0 and float(gradient @ step) < REST:
            return _finished(pose.moved(step), normal, cost, iteration)
        tried = pose.moved(step)
        found = whitened(camera, points, sight, tried)
        cost_tried = math.inf if found is None else float(found[0] @ found[0]) + _prior_cost(prior, tried)
        if found is not None and cost_tried <= cost * (1.0 + 1e-12):
            gain = cost - cost_tried
            damping = 0.0 if damping <= FIRST_DAMPING else 0.1 * damping
            pose, cost = tried, cost_tried
            off, rows = found
            if gain <= 1e-12 * cost and float(gradient @ step) < 1e-3:  # rounding, with a tiny sigma
                return _finished(pose, rows.T @ rows if prior is None else normal, cost, iteration)
        else:
            damping = max(FIRST_DAMPING, 10.0 * damping)
            if damping > MOST_DAMPING:
                return _finished(pose, normal, cost, iteration)
    return PoseFit(pose, np.full((6, 6), np.nan), cost, MOST_ITERATIONS, converged=False)


def _step(normal: Floats, gradient: Floats, damping: float) -> Floats | None:
    if damping:
        normal = normal.copy()
        normal.flat[::7] *= 1.0 + damping
    try:
        step: Floats = np.linalg.solve(normal, gradient).astype(np.float64, copy=False)
        return step
    except np.linalg.LinAlgError:
        return None


def _prior_cost(prior: PosePrior | None, pose: Pose) -> float:
    if prior is None:
        return 0.0
    off = pose.minus(prior.mean)
    return float(off @ prior.information @ off)


def _finished(pose: Pose, normal: Floats, cost: float, iterations: int) -> PoseFit:
    scale = 1.0 / np.sqrt(np.maximum(normal.flat[::7], 1e-300))
    try:
        covariance = np.linalg.inv(normal * scale * scale[:, None])
    except np.linalg.LinAlgError:
        return PoseFit(pose, np.full((6, 6), np.nan), cost, iterations, converged=False)
    inflated = covariance.flat[::7]  # how much worse each number is known than if it were alone
    if not (inflated.min() > 0.0 and inflated.max() < _MOST_INFLATION):
        return PoseFit(pose, np.full((6, 6), np.nan), cost, iterations, converged=False)
    covariance = covariance * scale * scale[:, None]
    return PoseFit(pose, 0.5 * (covariance + covariance.T), cost, iterations, converged=True)


def _nothing(pose: Pose) -> PoseFit:
    return PoseFit(pose, np.full((6, 6), np.nan), float("inf"), 0, converged=False)
