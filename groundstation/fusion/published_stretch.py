"""A stretch of a flight for the published offset fit: start state, samples, headings, fixes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.fusion.flight_data import FlightData
from groundstation.fusion.published_offset_fit import (
    PublishedOffsets,
    StretchStart,
    WayInOffsets,
    fit_published_offsets,
    nearest_samples,
    way_in_offsets,
)
from groundstation.fusion.published_steps import MAX_ACC_M_S2, MAX_RATE_RAD_S, zeros_of_rest

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class PublishedStretch:
    """What the fit was given, and what it gave.

    Attributes:
        fit: Offsets beyond the zeros of the rest.
        zeros: Of the rest: rate, ax, ay.
        way: The integrated way.
        end_s: Moments of its samples, shape (n,).
        fix_s: Exposures of the fixes, shape (m,).
        star_m: Their positions, of the accelerometers, shape (2, m).
    """

    fit: PublishedOffsets
    zeros: tuple[float, float, float]
    way: WayInOffsets
    end_s: Array
    fix_s: Array
    star_m: Array


def fit_published_stretch(data: FlightData, start_s: float, end_s: float) -> PublishedStretch:
    """Fit the offsets over a stretch.

    A stretch from the rest starts at its end, where the last fix of the rest saw the vehicle standing; any
    other at its first fix, with the velocity by the difference of the first two.

    Args:
        data: A flight, screened and in order.
        start_s: Start of the stretch.
        end_s: Its end.

    Raises:
        ValueError: There is too little in the stretch.
    """
    imu, stars = data.imu, data.stars[np.argsort(data.stars[:, 0], kind="stable")]
    rest = imu[imu[:, 0] <= data.run_start_s]
    zeros = zeros_of_rest(*rest[:, 1:4].T) if len(rest) else (0.0, 0.0, 0.0)
    start, heading = _start(data, stars, start_s, end_s)
    samples = imu[(imu[:, 0] > start.t_s) & (imu[:, 0] <= end_s)]
    fixes = stars[(stars[:, 0] > start.t_s) & (stars[:, 0] <= end_s)]
    if len(samples) < 2 or not len(fixes):
        raise ValueError("there are too few samples or fixes in the stretch")
    readings = samples[:, 1:4].T - np.array(zeros)[:, None]
    t = samples[:, 0]
    turned = heading + np.cumsum(readings[0] * np.diff(t, prepend=start.t_s))
    c, s = np.cos(turned), np.sin(turned)
    table = np.abs([c * readings[1] - s * readings[2], s * readings[1] + c * readings[2]])
    good = (table <= MAX_ACC_M_S2).all(axis=0) & (np.abs(readings[0]) <= MAX_RATE_RAD_S)
    if good.sum() < 2:
        raise ValueError("no sample of the stretch lies within the published limits")
    t, readings = t[good], readings[:, good]
    turned = heading + np.cumsum(readings[0] * np.diff(t, prepend=start.t_s))
    way = way_in_offsets(start, t, turned, readings[1:])
    sample = nearest_samples(t, fixes[:, 0])
    points = _points(data, fixes)
    fit = fit_published_offsets(way, sample, points)
    return PublishedStretch(fit, zeros, way, t, fixes[:, 0], points)


def _start(data: FlightData, stars: Array, start_s: float, end_s: float) -> tuple[StretchStart, float]:
    """Return the start state of the accelerometers, and the heading."""
    resting = stars[stars[:, 0] <= data.run_start_s]
    if start_s <= data.run_start_s and len(resting):
        (x_m,), (y_m,) = _points(data, resting[-1:])
        return StretchStart(data.run_start_s, x_m, y_m, 0.0, 0.0), float(resting[-1, 4])
    inside = stars[(stars[:, 0] >= start_s) & (stars[:, 0] <= end_s)]
    if len(inside) < 3:
        raise ValueError(f"the stretch needs 3 fixes, two for its start state, found {len(inside)}")
    (x0, x1), (y0, y1) = _points(data, inside[:2])
    t0, t1 = inside[:2, 0].tolist()
    return StretchStart(t0, x0, y0, (x1 - x0) / (t1 - t0), (y1 - y0) / (t1 - t0)), float(inside[0, 4])


def _points(data: FlightData, fixes: Array) -> Array:
    """Return where the accelerometers are at fixes (m, 5), shape (2, m)."""
    rx, ry = data.noise.imu_offset_x_m, data.noise.imu_offset_y_m
    headings = fixes[:, 4].tolist()
    lever = [(math.cos(h) * rx - math.sin(h) * ry, math.sin(h) * rx + math.cos(h) * ry) for h in headings]
    return np.asarray(fixes[:, 2:4].T + np.array(lever).reshape(-1, 2).T)
