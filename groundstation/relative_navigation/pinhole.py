"""How a camera without distortion sees, and the published form of the same.

``u = f X/Z + cx``, ``v = f Y/Z + cy`` for a point (X, Y, Z) in camera axes.

The publication on the Chibis-M puts the origin into the middle of the sensor and a negative focal length f:
``x_p = x / (1 - x3/f)``, that is ``x |f| / (|f| + x3)``: an upright image whose centre of projection lies at
the distance |f| *behind* the sensor. It is this pinhole with ``Z = x3 + |f|``: `from_published` converts.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

MOST_PX = 1e5
MOST_PIXELS = 50_000_000
"""Of a picture: no camera for motion has more, and each is held in memory several times."""


@dataclass(frozen=True, slots=True)
class PinholeCamera:
    """A camera whose pictures are free of distortion.

    Attributes:
        f_px: Focal length.
        cx_px: Principal point.
        cy_px: Principal point.
        width_px: Columns of a picture.
        height_px: Rows of a picture.

    Raises:
        ValueError: A value that no camera has.
    """

    f_px: float
    cx_px: float
    cy_px: float
    width_px: int
    height_px: int

    def __post_init__(self) -> None:
        for name, least in (("f_px", 1.0), ("width_px", 16), ("height_px", 16)):
            value = getattr(self, name)
            if not least <= value <= MOST_PX:
                raise ValueError(f"{name} is {value:g}, expected {least:g} to {MOST_PX:g}")
        if self.width_px * self.height_px > MOST_PIXELS:
            raise ValueError(
                f"width_px x height_px is {self.width_px} x {self.height_px}, expected at most {MOST_PIXELS} "
                "pixels in all"
            )
        for name in ("cx_px", "cy_px"):
            if not abs(getattr(self, name)) <= MOST_PX:
                raise ValueError(f"{name} is {getattr(self, name):g}, expected at most {MOST_PX:g}")

    def project(self, points_camera_m: Floats) -> Floats:
        """Return the pixels (..., 2) of points (..., 3) in camera axes; they must lie in front."""
        found: Floats = self.f_px * points_camera_m[..., :2] / points_camera_m[..., 2:]
        found += (self.cx_px, self.cy_px)
        return found

    def rays(self, pixels: Floats) -> Floats:
        """Return unit vectors (n, 3) in camera axes towards pixels (n, 2)."""
        plane = (pixels - (self.cx_px, self.cy_px)) / self.f_px
        rays = np.concatenate((plane, np.ones((len(pixels), 1))), axis=1)
        found: Floats = rays / np.linalg.norm(rays, axis=1, keepdims=True)
        return found

    def sees(self, pixels: Floats) -> NDArray[np.bool_]:
        """Return which pixels (..., 2) lie in the picture."""
        u, v = pixels[..., 0], pixels[..., 1]
        inside: NDArray[np.bool_] = (
            (u >= -0.5) & (u <= self.width_px - 0.5) & (v >= -0.5) & (v <= self.height_px - 0.5)
        )
        return inside


def from_published(position_m: Floats, focal_length_m: float) -> Floats:
    """Return a position (3,) in our camera axes from one of the publication's.

    Args:
        position_m: In its axes, origin in the middle of the sensor; its x2 as our y.
        focal_length_m: As published, negative.

    Raises:
        ValueError: The focal length is not negative.
    """
    if not focal_length_m < 0.0:
        raise ValueError(f"the published focal length is negative, found {focal_length_m:g}")
    return np.array((position_m[0], position_m[1], position_m[2] - focal_length_m))
