"""Light of points, standing or streaking, onto pixels.

A streak is a row of Gaussians at most one standard deviation apart: their sum is smooth to 1e-8. The Gaussian
is separable, so a piece of streak is one small matrix product; pixels far from any light are never touched.
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_PIECE = 12  # steps of a streak that share a patch: longer ones waste pixels beside a slanting streak
_REACH = 4.5  # standard deviations around a step that are drawn; beyond lies 4e-5 of the light per axis
_PIXEL_VARIANCE = 1.0 / 12.0  # a pixel averages the light over its square


def steps_of(longest_streak_px: float, sigma_px: float) -> int:
    """How many steps a streak of this length needs, a multiple of what shares a patch if it is long."""
    steps = max(1, int(np.ceil(longest_streak_px / sigma_px)))
    pieces = -(-steps // _PIECE)
    return pieces * -(-steps // pieces)


def add_spots(light: NDArray[np.float32], path_px: Floats, flux: Floats, sigma_px: float) -> None:
    """Add the light of points that moved while the shutter was open.

    The square pixel's averaging is taken as Gaussian too (variance 1/12 px^2), which is off by 5e-4 of the
    peak at a standard deviation of 1.2 px and leaves centroids exact.

    Args:
        light: Picture (rows, columns) to add to.
        path_px: Steps (u, v) of each point at equal times, shape (n, k, 2), k as from `steps_of`.
        flux: Light of each point over the whole exposure, shape (n,), in the picture's unit.
        sigma_px: Standard deviation of the lens's point spread.
    """
    count, steps = path_px.shape[:2]
    if count == 0:
        return
    pieces = -(-steps // _PIECE)
    piece_steps = steps // pieces
    path = path_px.reshape(count * pieces, piece_steps, 2)
    weight = np.repeat(flux / steps, pieces)
    variance = sigma_px**2 + _PIXEL_VARIANCE
    reach = int(np.ceil(_REACH * np.sqrt(variance)))
    corner = np.floor(path.min(axis=1)).astype(np.intp) - reach
    size = int(np.max(np.ceil(path.max(axis=1)).astype(np.intp) - corner)) + reach + 1
    offset = (path - corner[:, None, :]).astype(np.float32)
    pixel = np.arange(size, dtype=np.float32)
    u = np.exp((pixel - offset[..., 0, None]) ** 2 * np.float32(-0.5 / variance))
    v = np.exp((pixel - offset[..., 1, None]) ** 2 * np.float32(-0.5 / variance))
    u *= (weight / (2.0 * np.pi * variance)).astype(np.float32)[:, None, None]
    patches = np.swapaxes(v, 1, 2) @ u
    rows, columns = light.shape
    for patch, (left, top) in zip(patches, corner.tolist(), strict=True):
        right, bottom = min(left + size, columns), min(top + size, rows)
        first_column, first_row = max(left, 0), max(top, 0)
        if first_column < right and first_row < bottom:
            light[first_row:bottom, first_column:right] += patch[
                first_row - top : bottom - top, first_column - left : right - left
            ]
