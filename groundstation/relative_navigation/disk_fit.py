"""Round spots fitted as disks with a soft edge: sub-pixel centres with their covariance, all spots at once.

``I = b + A step((r - d) / s)`` averaged over each pixel's area, d the distance from the centre; unknown are
the centre, A and r. The background b is the picture's. A spot that is no disk shows in its residuals: they
widen its covariance. Of a spot hardly larger than a pixel only the light is seen, A times the area: its A is
that of the picture's other spots, and then its centre is four times better known. The compiled core does it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.core.library import default_core

Floats = NDArray[np.float64]
Picture = NDArray[np.uint8]

EDGE_PX = 0.35
"""Softness of an edge beside the pixel's own size: optics."""
LARGE_PX = 2.5
"""Radius from which a pixel needs no sub-pixels; its size then goes into the edge."""
_LARGE_EDGE_PX = 0.75
ITERATIONS = 5
REST_PX = 0.006
"""After a step of this the next one would be a hundredth of it."""
FLOOR_PX = 0.004
"""What the model of a disk leaves of a perfect one."""
MOST_HALF_PX = 40
MARGIN_PX = 1.3
"""Around a rough radius, which is that of the blob's box."""
UNRESOLVED_PX = 1.3
"""Radius below which height and radius of a spot cannot be told apart."""
POINT_PX, POINT_FLOOR_PX = 0.72, 0.03
"""Below this radius no pixel is covered whole, and the height of such spots alone stays uncertain."""


@dataclass(frozen=True, slots=True, eq=False)
class DiskFits:
    """Fitted spots.

    Attributes:
        centres: (n, 2).
        covariances: (n, 2, 2), residuals accounted for.
        heights: A, (n,).
        radii: r, (n,).
        misfits: Mean square of the residuals over the noise, (n,): 1 for a disk.
    """

    centres: Floats
    covariances: Floats
    heights: Floats
    radii: Floats
    misfits: Floats


def fit_disks(
    picture: Picture, centres: Floats, radii: Floats, level: float, sigma: float, height: float | None = None
) -> DiskFits:
    """Return disks fitted around rough centres.

    Args:
        picture: Grey, (h, w).
        centres: Rough, (n, 2); pixels outside the picture do not count.
        radii: Rough, (n,).
        level: Background.
        sigma: Noise.
        height: A of spots below `UNRESOLVED_PX`; None: the most that any pixel of the spots stands out.
    """
    core = default_core()
    picture = np.ascontiguousarray(picture)
    rough = np.column_stack((centres, np.minimum(radii, MOST_HALF_PX))).astype(np.float64)
    found = np.empty((len(rough), 8))
    settings = core.ffi.new(
        "DiskSettings *",
        {
            "level_dn": level,
            "noise_dn": sigma,
            "height_dn": -1.0 if height is None else height,
            "margin_px": MARGIN_PX,
            "edge_px": EDGE_PX,
            "large_edge_px": _LARGE_EDGE_PX,
            "large_px": LARGE_PX,
            "unresolved_px": UNRESOLVED_PX,
            "rest_px": REST_PX,
            "iterations": ITERATIONS,
        },
    )
    core.lib.gs_fit_disks(
        core.ffi.cast("uint8_t *", picture.ctypes.data),
        picture.strides[0],
        *picture.shape,
        core.ffi.cast("RoughDisk *", rough.ctypes.data),
        len(rough),
        settings,
        core.ffi.cast("FittedDisk *", found.ctypes.data),
    )
    misfits, fitted = found[:, 4], found[:, 3]
    covariances = np.empty((len(rough), 2, 2))
    scale = sigma**2 * np.maximum(1.0, misfits)
    covariances[:, 0, 0], covariances[:, 1, 1] = scale * found[:, 5], scale * found[:, 7]
    covariances[:, 0, 1] = covariances[:, 1, 0] = scale * found[:, 6]
    floor = np.full(len(rough), FLOOR_PX**2)
    if height is None:  # the height of the others is only as good as the best of their pixels
        floor[fitted < POINT_PX] += POINT_FLOOR_PX**2
    covariances[:, 0, 0] += floor
    covariances[:, 1, 1] += floor
    return DiskFits(found[:, :2], covariances, found[:, 2], fitted, misfits)
