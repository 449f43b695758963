"""Bundle adjustment of a ceiling: poses, stars and the camera from many pictures at once.

Observations are pixels; the model is the full camera (distortion, mount, height) of a level body.
Gauss-Newton on the sparse normal equations with re-weighted residuals (Triggs et al., Bundle
Adjustment: A Modern Synthesis, 2000). One engine serves the survey (stars free), the intrinsics
(camera free) and the mount (offset and tilt free).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import cho_factor, cho_solve

from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.projection import project, seen_from_body

Array = NDArray[np.float64]
Index = NDArray[np.int64]

HEIGHT = ("ceiling_height_above_camera_m",)
TILT = ("mount_tilt_x_rad", "mount_tilt_y_rad")
OFFSET = ("mount_offset_x_m", "mount_offset_y_m")
FOCAL = ("fx", "fy")
CENTRE = ("cx", "cy")
DISTORTION = ("k1", "k2", "p1", "p2")

_STEP = {
    **dict.fromkeys(HEIGHT + OFFSET, 1e-5),
    **dict.fromkeys(TILT, 1e-6),
    **dict.fromkeys(FOCAL + CENTRE, 1e-3),
    **dict.fromkeys(DISTORTION, 1e-6),
}
_CLIP_SIGMAS = 4.0
_SOFT_SIGMAS = 2.0
_SETTLED_RATIO = 1e-4
_HARD_STEPS = 4
_HOLD_STD_M = 10.0
_SHARES = (1.0, 0.5, 0.25, 0.1, 0.03, 0.01)
_GROWTH = 1.01


@dataclass(frozen=True, slots=True, eq=False)
class Observations:
    """Which star was seen where in which picture; shapes (m,), pixels (m, 2)."""

    frame: Index
    star: Index
    pixel: Array
    sigma_px: Array


@dataclass(frozen=True, slots=True, eq=False)
class StarPrior:
    """Stars known beforehand: rows, positions (k, 2) in m, and their standard deviation (k,)."""

    star: Index
    position_m: Array
    sigma_m: Array


@dataclass(frozen=True, slots=True, eq=False)
class PosePriorTerm:
    """All body origins are one place, within a standard deviation: a mock-up turned in place."""

    sigma_m: float


@dataclass(frozen=True, slots=True, eq=False)
class Adjusted:
    """Result of an adjustment.

    Attributes:
        camera: The camera with its free values adjusted.
        pose: x, y, heading of every picture, shape (f, 3).
        star_m: Star positions, shape (s, 2).
        covariance_star_m2: Joint covariance of all star coordinates (x0, y0, x1, ...), (2s, 2s).
        sigma_camera: One sigma of every free camera value, by name.
        residual_px: Observed minus modelled, shape (m, 2).
        used: Which observations were not clipped, shape (m,).
        rms_px: Root mean square per axis of the used residuals.
    """

    camera: CameraCalibration
    pose: Array
    star_m: Array
    covariance_star_m2: Array
    sigma_camera: dict[str, float]
    residual_px: Array
    used: NDArray[np.bool_]
    rms_px: float


def adjust(
    camera: CameraCalibration,
    pose: Array,
    star_m: Array,
    seen: Observations,
    *,
    free: Sequence[str] = (),
    known: StarPrior | None = None,
    in_place: PosePriorTerm | None = None,
    iterations: int = 25,
    progress: Callable[[int, float], None] | None = None,
) -> Adjusted:
    """Adjust poses, stars and the camera's free values to the observations.

    Args:
        camera: First guess.
        pose: First guess (f, 3).
        star_m: First guess (s, 2).
        seen: Observations.
        free: Names of the camera values to adjust (the constants of this module).
        known: Stars known beforehand; they fix the frame of the table.
        in_place: All body origins are one place.
        iterations: At most so many Gauss-Newton steps.
        progress: Called with the step's number and the residual RMS in px.

    Raises:
        ValueError: The observations do not determine the unknowns.
    """
    pose, star_m = pose.copy(), star_m.copy()
    scale2 = 1.0
    weight = np.ones(len(seen.frame))
    is_hard = False
    last = np.inf
    for step in range(iterations):
        normal, gradient = _normal_equations(camera, pose, star_m, seen, weight, free, known, in_place)
        change = _solve(normal, gradient)
        before = float(weight @ _distance2(_residual(camera, pose, star_m, seen), seen))
        for share in _SHARES:  # a full step from a lens far off may lead away
            trial = _stepped(camera, pose, star_m, free, share * change)
            residual = _residual(*trial, seen)
            if float(weight @ _distance2(residual, seen)) <= _GROWTH * before:
                break
        camera, pose, star_m = trial
        distance2 = _distance2(residual, seen)
        scale2 = max(float(np.median(distance2)) / 1.386, 1e-6)
        used = distance2 <= _CLIP_SIGMAS**2 * 2.0 * scale2
        # Soft weights first: a picture whose guess is bad must not lose all of its stars at once.
        soft = 1.0 / (1.0 + distance2 / (_SOFT_SIGMAS**2 * 2.0 * scale2))
        weight = used.astype(np.float64) if is_hard else soft
        rms = float(np.sqrt(np.mean(residual[used] ** 2)))
        if progress is not None:
            progress(step + 1, rms)
        settled = abs(last - rms) < _SETTLED_RATIO * rms
        if settled and is_hard:
            break
        is_hard = is_hard or settled or step >= iterations - _HARD_STEPS
        last = rms
    used = weight > 0.5
    normal, _ = _normal_equations(camera, pose, star_m, seen, weight, free, known, in_place)
    freedom = max(2 * int(used.sum()) - normal.shape[0], 1)
    total = float((distance2[used]).sum())
    covariance = _inverse(normal) * (total / freedom)
    stars = slice(len(free) + pose.size, None)
    sigma = {name: float(np.sqrt(covariance[i, i])) for i, name in enumerate(free)}
    return Adjusted(camera, pose, star_m, covariance[stars, stars], sigma, residual, used, rms)


def _stepped(
    camera: CameraCalibration, pose: Array, star_m: Array, free: Sequence[str], change: Array
) -> tuple[CameraCalibration, Array, Array]:
    moved = change[len(free) :]
    return (
        _with_values(camera, free, _values(camera, free) + change[: len(free)]),
        pose + moved[: pose.size].reshape(-1, 3),
        star_m + moved[pose.size :].reshape(-1, 2),
    )


def _residual(camera: CameraCalibration, pose: Array, star_m: Array, seen: Observations) -> Array:
    return np.asarray(seen.pixel - project(camera, pose[seen.frame], star_m[seen.star])[0])


def _distance2(residual_px: Array, seen: Observations) -> Array:
    return np.asarray((residual_px**2).sum(axis=1) / seen.sigma_px**2)


def _normal_equations(
    camera: CameraCalibration,
    pose: Array,
    star_m: Array,
    seen: Observations,
    weight: Array,
    free: Sequence[str],
    known: StarPrior | None,
    in_place: PosePriorTerm | None,
) -> tuple[Array, Array]:
    m, g = len(seen.frame), len(free)
    at = pose[seen.frame]
    pixel, by_flat = project(camera, at, star_m[seen.star])
    c, s = np.cos(at[:, 2]), np.sin(at[:, 2])
    turn = np.stack((np.stack((c, s), axis=1), np.stack((-s, c), axis=1)), axis=1)  # R(-heading)
    by_star = by_flat @ turn
    flat = seen_from_body(at, star_m[seen.star])
    by_heading = by_flat @ np.stack((flat[:, 1], -flat[:, 0]), axis=1)[:, :, None]
    values = _values(camera, free)
    by_camera = np.empty((m, 2, g))
    for i, name in enumerate(free):
        ahead, behind = values.copy(), values.copy()
        ahead[i] += _STEP[name]
        behind[i] -= _STEP[name]
        plus = project(_with_values(camera, free, ahead), at, star_m[seen.star])[0]
        minus = project(_with_values(camera, free, behind), at, star_m[seen.star])[0]
        by_camera[:, :, i] = (plus - minus) / (2.0 * _STEP[name])
    block = np.concatenate((by_camera, -by_star, by_heading, by_star), axis=2)
    columns = np.concatenate(
        (
            np.broadcast_to(np.arange(g), (m, g)),
            g + 3 * seen.frame[:, None] + np.arange(3),
            g + pose.size + 2 * seen.star[:, None] + np.arange(2),
        ),
        axis=1,
    )
    root = np.sqrt(weight) / seen.sigma_px
    rows = np.repeat(np.arange(2 * m), g + 5)
    jacobian = sparse.csr_array(
        ((root[:, None, None] * block).ravel(), (rows, np.repeat(columns[:, None], 2, axis=1).ravel())),
        shape=(2 * m, g + pose.size + star_m.size),
    )
    error = (root[:, None] * (seen.pixel - pixel)).ravel()
    normal = (jacobian.T @ jacobian).toarray()
    held = g + np.arange(pose.size + star_m.size)
    normal[held, held] += _HOLD_STD_M**-2  # what has no sighting left, all being clipped, stays
    gradient = jacobian.T @ error
    if known is not None:
        row = g + pose.size + 2 * known.star[:, None] + np.arange(2)
        pull = 1.0 / known.sigma_m[:, None] ** 2
        normal[row, row] += np.broadcast_to(pull, row.shape)
        gradient[row] += pull * (known.position_m - star_m[known.star])
    if in_place is not None:
        pull_in_place = 1.0 / in_place.sigma_m**2
        frames = len(pose)
        for axis in range(2):
            row = g + 3 * np.arange(frames) + axis
            # Distance from the mean of all: the projector I - 11'/f.
            normal[np.ix_(row, row)] += pull_in_place * (np.eye(frames) - 1.0 / frames)
            gradient[row] -= pull_in_place * (pose[:, axis] - pose[:, axis].mean())
    return np.asarray(normal), np.asarray(gradient)


def _solve(normal: Array, gradient: Array) -> Array:
    scale = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
    try:
        factor = cho_factor(normal * scale[:, None] * scale[None, :])
    except np.linalg.LinAlgError as error:
        raise ValueError("the pictures do not determine the unknowns") from error
    return np.asarray(scale * cho_solve(factor, scale * gradient), dtype=np.float64)


def _inverse(normal: Array) -> Array:
    scale = 1.0 / np.sqrt(np.diag(normal))
    factor = cho_factor(normal * scale[:, None] * scale[None, :])
    return np.asarray(cho_solve(factor, np.eye(len(normal))) * scale[:, None] * scale[None, :])


def _values(camera: CameraCalibration, names: Sequence[str]) -> Array:
    k1, k2, p1, p2, _ = camera.distortion
    offset = camera.mount_offset_body_m
    extra = {
        "k1": k1,
        "k2": k2,
        "p1": p1,
        "p2": p2,
        "mount_offset_x_m": offset[0],
        "mount_offset_y_m": offset[1],
    }
    return np.array([extra[name] if name in extra else getattr(camera, name) for name in names])


def _with_values(camera: CameraCalibration, names: Sequence[str], values: Array) -> CameraCalibration:
    given: dict[str, Any] = dict(zip(names, (float(value) for value in values), strict=True))
    k1, k2, p1, p2, k3 = camera.distortion
    x, y, z = camera.mount_offset_body_m
    distortion = (given.pop("k1", k1), given.pop("k2", k2), given.pop("p1", p1), given.pop("p2", p2), k3)
    offset = (given.pop("mount_offset_x_m", x), given.pop("mount_offset_y_m", y), z)
    return replace(camera, distortion=distortion, mount_offset_body_m=offset, **given)
