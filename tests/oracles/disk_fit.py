"""Disks fitted to round spots in NumPy: what ``groundstation/core/disks.c`` must agree with.

All spots go on together until the last has come to rest; the core lets each rest by itself.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.disk_fit import (
    _LARGE_EDGE_PX,
    EDGE_PX,
    FLOOR_PX,
    ITERATIONS,
    LARGE_PX,
    MARGIN_PX,
    MOST_HALF_PX,
    POINT_FLOOR_PX,
    POINT_PX,
    REST_PX,
    UNRESOLVED_PX,
    DiskFits,
)

Floats = NDArray[np.float64]
Picture = NDArray[np.uint8]

_SUB = np.array((-0.25, 0.25))


def fit_disks(
    picture: Picture, centres: Floats, radii: Floats, level: float, sigma: float, height: float | None = None
) -> DiskFits:
    """Return disks fitted around rough centres.

    Args:
        picture: Grey, (h, w).
        centres: Rough, (n, 2); at least a window's half inside the picture counts, the rest is cut.
        radii: Rough, (n,).
        level: Background.
        sigma: Noise.
        height: A of spots below `UNRESOLVED_PX`; None: the most that any pixel of the spots stands out.
    """
    half = min(MOST_HALF_PX, int(np.ceil(float(radii.max()) + MARGIN_PX)))
    sub, edge = (_SUB, EDGE_PX) if float(radii.max()) < LARGE_PX else (np.zeros(1), _LARGE_EDGE_PX)
    values, du, dv, weight = _windows(picture, centres, radii, half, level)
    count, pixels = values.shape
    parameters = np.empty((count, 4))
    parameters[:, :2] = 0.0
    parameters[:, 2] = np.maximum(values.max(axis=1), 3.0 * sigma)
    parameters[:, 3] = radii
    small = np.flatnonzero(radii < UNRESOLVED_PX)
    if len(small):
        common = float(parameters[small, 2].max()) if height is None else height
        light = (values[small] * weight[small]).sum(axis=1)
        parameters[small, 2] = np.maximum(common, parameters[small, 2] - 2.0 * sigma)
        parameters[small, 3] = np.sqrt(np.maximum(light / parameters[small, 2], 0.2) / np.pi)
    across, down = np.meshgrid(sub, sub)
    places_u = du[:, :, None] + across.ravel()
    places_v = dv[:, :, None] + down.ravel()
    start = radii.copy()
    rows = np.empty((count, pixels, 4))
    off, normal = values, np.empty((count, 4, 4))
    for _ in range(ITERATIONS):
        off, normal, right = _normal(values, weight, places_u, places_v, edge, parameters, rows)
        normal[small, 2, :] = 0.0
        normal[small, :, 2] = 0.0
        right[small, 2] = 0.0
        normal[small, 2, 2] = 1.0
        diagonal = normal[:, range(4), range(4)]
        normal[:, range(4), range(4)] = diagonal * (1.0 + 1e-6) + 1e-9
        step = np.linalg.solve(normal, right[:, :, None])[:, :, 0]
        step[:, :2] = np.clip(step[:, :2], -0.7, 0.7)
        step[:, 3] = np.clip(step[:, 3], -0.5 * parameters[:, 3], 0.5 * parameters[:, 3])
        parameters += step
        parameters[:, 3] = np.clip(parameters[:, 3], 0.35, 2.0 * start + 1.0)
        parameters[:, 2] = np.clip(parameters[:, 2], sigma, 600.0)
        if float(np.abs(step[:, :2]).max()) < REST_PX:
            break
    used = weight.sum(axis=1)
    misfits = (off * off).sum(axis=1) / (sigma**2 * np.maximum(1.0, used - 4.0))
    covariances = sigma**2 * np.linalg.inv(normal)[:, :2, :2] * np.maximum(1.0, misfits)[:, None, None]
    floor = np.full(count, FLOOR_PX**2)
    if height is None:  # the height of the others is only as good as the best of their pixels
        floor[parameters[:, 3] < POINT_PX] += POINT_FLOOR_PX**2
    covariances = covariances + floor[:, None, None] * np.eye(2)
    return DiskFits(centres + parameters[:, :2], covariances, parameters[:, 2], parameters[:, 3], misfits)


def _windows(
    picture: Picture, centres: Floats, radii: Floats, half: int, level: float
) -> tuple[Floats, Floats, Floats, Floats]:
    """Values above the background, places relative to the rough centres, and weights, each (n, pixels)."""
    height, width = picture.shape
    reach = np.arange(-half, half + 1)
    middle = np.round(centres).astype(np.int64)
    columns, rows = middle[:, 0, None] + reach, middle[:, 1, None] + reach
    good = (rows[:, :, None] >= 0) & (rows[:, :, None] < height)
    good = good & (columns[:, None] >= 0) & (columns[:, None] < width)
    values = picture[np.clip(rows, 0, height - 1)[:, :, None], np.clip(columns, 0, width - 1)[:, None]]
    shape = values.shape
    du = np.broadcast_to((columns - centres[:, :1])[:, None], shape).reshape(len(centres), -1)
    dv = np.broadcast_to((rows - centres[:, 1:])[:, :, None], shape).reshape(len(centres), -1)
    weight = good.reshape(len(centres), -1) & (du * du + dv * dv <= (radii[:, None] + MARGIN_PX) ** 2)
    if len(centres) > 1:  # pixels nearer to another spot belong to it
        apart = np.linalg.norm(centres[:, None] - centres[None], axis=2)
        for one, other in np.argwhere((apart > 0.0) & (apart < 2.0 * half + 2.0)):
            between = centres[other] - centres[one]
            nearer = np.hypot(du[one] - between[0], dv[one] - between[1]) - radii[other]
            weight[one] &= nearer > np.hypot(du[one], dv[one]) - radii[one]
    kept = np.argsort(~weight, axis=1, kind="stable")[:, : max(1, int(weight.sum(axis=1).max()))]
    found = (values.reshape(len(centres), -1) - level, du, dv, weight.astype(np.float64))
    cut = tuple(np.take_along_axis(each, kept, axis=1) for each in found)
    return cut[0], cut[1], cut[2], cut[3]


def _normal(
    values: Floats,
    weight: Floats,
    places_u: Floats,
    places_v: Floats,
    edge: float,
    parameters: Floats,
    rows: Floats,
) -> tuple[Floats, Floats, Floats]:
    u, v, height, radius = parameters.T[:, :, None, None]
    x, y = places_u - u, places_v - v
    distance = np.sqrt(x * x + y * y + 1e-12)
    # a smooth step instead of Phi: 3 t^2 - 2 t^3
    deep = np.clip((radius - distance) * (0.5 / edge) + 0.5, 0.0, 1.0)
    square = deep * deep
    cover = square * (3.0 - 2.0 * deep)
    slope = (deep - square) * (3.0 / edge)
    share = 1.0 / x.shape[2]
    push = slope / distance
    scaled = (share * height[:, :, 0]) * weight
    rows[:, :, 0] = scaled * (push * x).sum(axis=2)
    rows[:, :, 1] = scaled * (push * y).sum(axis=2)
    shape = share * cover.sum(axis=2) * weight
    rows[:, :, 2] = shape
    rows[:, :, 3] = scaled * slope.sum(axis=2)
    off = values * weight - height[:, :, 0] * shape
    turned = rows.transpose(0, 2, 1)
    return off, turned @ rows, (turned @ off[:, :, None])[:, :, 0]
