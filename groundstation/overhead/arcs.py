"""Circles of known radius from parts of their rims: covered, touching, or cut by the picture's edge.

Rim points are where the share in the circle passes one half between two pixels. Any two of them give two
circles of the known radius; the one most rim points lie on is taken, refined by least squares, its points
are taken away, and the rest is looked at again.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Places = NDArray[np.complex128]

_SEEDS = 28  # rim points that are paired
_MAX_CIRCLES = 4
_NEAR_PX = 0.7  # a rim point this near lies on the circle
_ARC_BINS = 24
_MIN_ARC_BINS = 13  # 195 degrees of rim, else a straight edge or a hand may pass for a circle
_MIN_FILLED_RATIO = 0.45
_RIM_SIGMA_PX = 0.12  # at least: colour filter, blur over an uneven ground
_MIN_POINTS = 12
_CROSSINGS_PER_POINT = 2.0  # rows and columns cross one rim: two crossings are hardly more than one
_STEPS = 6


@dataclass(frozen=True, slots=True, eq=False)
class Arc:
    """A circle found by part of its rim: centre x + iy (m) and covariance (2, 2) in m^2."""

    place_m: complex
    covariance_m2: Array


def circles_of_rim(share: Array, places: Places, radius_m: float, pitch_m: float) -> list[Arc]:
    """Find circles in a window.

    Args:
        share: Each pixel's share in a circle, shape (h, w).
        places: Points x + iy of the plane that the pixels see, shape (h, w), m.
        radius_m: Of the circles.
        pitch_m: Side of a pixel on the plane.
    """
    rim = rim_points(share, places)
    found: list[Arc] = []
    for _ in range(_MAX_CIRCLES):
        if len(rim) < _MIN_POINTS:
            break
        centre = _best_start(rim, radius_m, pitch_m)
        refined = None if centre is None else _refine(rim, centre, radius_m, pitch_m)
        if refined is None:
            break
        place, covariance, on_it = refined
        rim = rim[~on_it]
        if _is_filled(share, places, place, radius_m) and not any(
            abs(place - other.place_m) < 1.5 * radius_m for other in found
        ):
            found.append(Arc(place, covariance))
    return found


def rim_points(share: Array, places: Places) -> Places:
    """Points (n,) where the share passes one half between neighbours of a row or a column."""
    points = []
    for axis in (0, 1):
        a, b = (share[:-1], share[1:]) if axis == 0 else (share[:, :-1], share[:, 1:])
        p, q = (places[:-1], places[1:]) if axis == 0 else (places[:, :-1], places[:, 1:])
        crosses = (a < 0.5) != (b < 0.5)
        part = (0.5 - a[crosses]) / (b[crosses] - a[crosses])
        points.append(p[crosses] + part * (q[crosses] - p[crosses]))
    return np.concatenate(points)


def _best_start(rim: Places, radius_m: float, pitch_m: float) -> complex | None:
    seeds = rim[np.linspace(0, len(rim) - 1, min(_SEEDS, len(rim))).astype(int)]
    first, second = np.triu_indices(len(seeds), 1)
    chord = seeds[second] - seeds[first]
    half = 0.5 * np.abs(chord)
    usable = (half > 0.3 * radius_m) & (half < radius_m)
    chord, half, middle = chord[usable], half[usable], (0.5 * (seeds[first] + seeds[second]))[usable]
    if len(chord) == 0:
        return None
    normal = 1j * chord / np.abs(chord) * np.sqrt(radius_m**2 - half**2)
    centres = np.concatenate((middle + normal, middle - normal))
    miss = np.abs(np.abs(rim[None] - centres[:, None]) - radius_m)
    votes = np.maximum(0.0, 1.0 - (miss / (_NEAR_PX * pitch_m)) ** 2).sum(axis=1)
    return complex(centres[int(np.argmax(votes))])


def _refine(
    rim: Places, centre: complex, radius_m: float, pitch_m: float
) -> tuple[complex, Array, NDArray[np.bool_]] | None:
    """Least squares on the rim points near a circle: centre, covariance, which points; None if too few."""
    near = np.zeros(len(rim), dtype=bool)
    information = np.eye(2)
    for _ in range(_STEPS):
        off = rim - centre
        miss = np.abs(off) - radius_m
        near = np.abs(miss) < _NEAR_PX * pitch_m
        if near.sum() < _MIN_POINTS:
            return None
        unit = off[near] / np.abs(off[near])
        direction = np.stack((unit.real, unit.imag), axis=1)
        information = direction.T @ direction
        step = np.linalg.lstsq(direction, miss[near], rcond=None)[0]
        centre += complex(step[0], step[1])
    bins = np.floor((np.angle(rim[near] - centre) / (2.0 * np.pi) + 0.5) * _ARC_BINS).astype(int) % _ARC_BINS
    if len(set(bins.tolist())) < _MIN_ARC_BINS:
        return None
    scatter = 1.4826 * float(np.median(np.abs(np.abs(rim[near] - centre) - radius_m)))
    sigma = max(scatter, _RIM_SIGMA_PX * pitch_m)
    covariance = np.linalg.inv(information) * (sigma**2 * _CROSSINGS_PER_POINT)
    taken = np.abs(np.abs(rim - centre) - radius_m) < 2.0 * _NEAR_PX * pitch_m
    return centre, np.asarray(covariance), taken


def _is_filled(share: Array, places: Places, centre: complex, radius_m: float) -> bool:
    within = np.abs(places - centre) < 0.85 * radius_m
    return bool(within.any()) and float(share[within].mean()) > _MIN_FILLED_RATIO
