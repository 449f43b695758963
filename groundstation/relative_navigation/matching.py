"""Which centre of a picture is which point: one to one, near a prediction.

Where the prediction is sharper than the gaps between points, nearest neighbours within their ellipses are
assigned so that the sum of squares is least. Where it is not, the errors of the points belong together: two
centres taken as two points pin the pose down, and the pair is taken that explains most of the others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from groundstation.relative_navigation.pinhole import PinholeCamera
from groundstation.relative_navigation.pixel_equations import jacobian, predicted_pixels
from groundstation.relative_navigation.pose import Pose

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

GATE = 18.4
"""Of a squared distance in sigmas, two dimensions: one true centre of ten thousand lies outside."""
PAIR_GATE = 23.5
"""Of the squared misfit of two centres, four dimensions: as seldom."""
SHARP_PX = 2.0
"""A prediction of points with a sigma below this is matched point by point."""
TRIES = 6
"""Pairs that are looked at more closely."""
_MOST_PAIRS = 20000


@dataclass(frozen=True, slots=True, eq=False)
class Centres:
    """What was found in a frame.

    Attributes:
        pixels: (k, 2).
        covariances: (k, 2, 2), px^2.
        points: Which point of the target each is, (k,), -1 where nobody knows; None: nobody knows any.
        sigma_px: Of all of them, where the covariances are all alike; None: look at these.
    """

    pixels: Floats
    covariances: Floats
    points: Ints | None = None
    sigma_px: float | None = None

    def __len__(self) -> int:
        return len(self.pixels)


@dataclass(frozen=True, slots=True, eq=False)
class Matches:
    """Pairs of point and centre, each used once: (m,) and (m,)."""

    point: Ints
    centre: Ints

    def __len__(self) -> int:
        return len(self.point)


def match_labelled(centres: Centres, count: int) -> Matches:
    """Return what labels say, of a target with ``count`` points; the first of a label counts."""
    if centres.points is None:
        return Matches(np.empty(0, np.int64), np.empty(0, np.int64))
    known = np.flatnonzero((centres.points >= 0) & (centres.points < count))
    _, first = np.unique(centres.points[known], return_index=True)
    return Matches(centres.points[known[first]], known[first])


def match_near(
    predicted: Floats, spreads: Floats, centres: Centres, reach_px: float | None = None
) -> Matches:
    """Assign centres to predicted points one to one.

    Args:
        predicted: (n, 2), NaN where a point has no picture.
        spreads: Covariances (n, 2, 2) of the prediction.
        centres: What was found.
        reach_px: The published neighbourhood epsilon: no pair is farther apart. Without it only the ellipse
            of prediction and centre together limits.
    """
    off = centres.pixels[None] - predicted[:, None]
    both = spreads[:, None] + centres.covariances[None]
    a, b, d = both[..., 0, 0], both[..., 0, 1], both[..., 1, 1]
    x, y = off[..., 0], off[..., 1]
    square = (d * x * x - 2.0 * b * x * y + a * y * y) / (a * d - b * b)
    far = ~(square < GATE)
    if reach_px is not None:
        far = ~(x * x + y * y < reach_px**2)
    if far.all():
        return Matches(np.empty(0, np.int64), np.empty(0, np.int64))
    rows, columns = linear_sum_assignment(np.where(far, 1e6, square))
    kept = ~far[rows, columns]
    return Matches(rows[kept].astype(np.int64), columns[kept].astype(np.int64))


def match_jointly(
    camera: PinholeCamera, points_body_m: Floats, centres: Centres, pose: Pose, covariance: Floats
) -> list[tuple[Pose, Matches]]:
    """Return poses that pairs of centres suggest, with what each of them explains, the best first.

    Args:
        camera: The camera.
        points_body_m: (n, 3).
        centres: What was found.
        pose: The prediction.
        covariance: Of it, (6, 6); it may leave points tens of pixels wide.
    """
    predicted = predicted_pixels(camera, points_body_m, pose)
    seen = np.flatnonzero(np.isfinite(predicted[:, 0]))
    if len(seen) < 2 or len(centres) < 2:
        return []
    rows = jacobian(camera, points_body_m[seen], pose)
    through = rows @ covariance  # (n, 2, 6)
    spreads = through @ rows.transpose(0, 2, 1)
    off = centres.pixels[None] - predicted[seen][:, None]
    both = spreads[:, None] + centres.covariances[None]
    square = np.einsum("nki,nki->nk", off, np.linalg.solve(both, off[..., None])[..., 0])
    point, centre = np.nonzero(square < GATE)
    one, other = np.triu_indices(len(point), 1)
    fits = (point[one] != point[other]) & (centre[one] != centre[other])
    one, other = one[fits][:_MOST_PAIRS], other[fits][:_MOST_PAIRS]
    if not len(one):
        return []
    h = np.concatenate((rows[point[one]], rows[point[other]]), axis=1)  # (pairs, 4, 6)
    miss = np.concatenate((off[point[one], centre[one]], off[point[other], centre[other]]), axis=1)
    noise = np.zeros((len(one), 4, 4))
    noise[:, :2, :2], noise[:, 2:, 2:] = centres.covariances[centre[one]], centres.covariances[centre[other]]
    ph = covariance @ h.transpose(0, 2, 1)
    right = np.linalg.solve(h @ ph + noise, np.concatenate((miss[..., None], ph.transpose(0, 2, 1)), axis=2))
    misfit = np.einsum("pi,pi->p", miss, right[..., 0])
    good = np.flatnonzero(misfit < PAIR_GATE)
    if not len(good):
        return []
    step = (ph[good] @ right[good][:, :, :1])[..., 0]
    after = covariance - ph[good] @ right[good][:, :, 1:]
    score = _explained(predicted[seen], rows, step, after, centres) - 0.5 * misfit[good]
    found: list[tuple[Pose, Matches]] = []
    for pick in np.argsort(-score)[: 4 * TRIES]:
        moved = pose.moved(step[pick])
        places = predicted_pixels(camera, points_body_m, moved)
        wide = jacobian(camera, points_body_m, moved)
        matches = match_near(places, wide @ after[pick] @ wide.transpose(0, 2, 1), centres)
        if all(_differ(matches, earlier) for _, earlier in found):
            found.append((moved, matches))
        if len(found) == TRIES:
            break
    return found


def _explained(predicted: Floats, rows: Floats, step: Floats, after: Floats, centres: Centres) -> Floats:
    """How much of a frame each pair's pose explains: a point near a centre counts up to `GATE` / 2."""
    places = predicted[None] + np.einsum("nij,pj->pni", rows, step)
    wide = np.einsum("nij,pjk,nlk->pnil", rows, after, rows) + centres.covariances.mean(axis=0)
    off = centres.pixels[None, None] - places[:, :, None]
    a, b, d = wide[..., 0, 0, None], wide[..., 0, 1, None], wide[..., 1, 1, None]
    x, y = off[..., 0], off[..., 1]
    square = ((d * x * x - 2.0 * b * x * y + a * y * y) / (a * d - b * b)).min(axis=2)
    size = 0.5 * np.log(np.maximum((a * d - b * b)[..., 0], 1e-12))
    gains: Floats = np.maximum(0.0, 0.5 * (GATE - square) - np.maximum(0.0, size)).sum(axis=1)
    return gains


def _differ(one: Matches, other: Matches) -> bool:
    pairs = set(zip(one.point.tolist(), one.centre.tolist(), strict=True))
    return pairs != set(zip(other.point.tolist(), other.centre.tolist(), strict=True))
