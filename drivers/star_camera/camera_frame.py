"""One picture of a camera as it reached the host."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class CameraFrame:
    """A picture, grey or in colour, and the moment it was complete on the host.

    Attributes:
        image: uint8, shape (height, width), or (height, width, 3) in blue-green-red; row 0 is
            the top row, x right, y down. Treat as read-only.
        stamp_arrival_ns: Host monotonic clock when the last byte had been read, not the exposure.
        sequence: Counts the pictures of one source, dropped ones included, from 0.
        stamp_device_ns: When the camera's driver had the picture, on the same clock, where it says so.
    """

    image: NDArray[np.uint8]
    stamp_arrival_ns: int
    sequence: int
    stamp_device_ns: int | None = None

    @property
    def stamp_ns(self) -> int:
        """The driver's stamp where there is one, which a busy host cannot delay; else the arrival's."""
        return self.stamp_arrival_ns if self.stamp_device_ns is None else self.stamp_device_ns

    def __post_init__(self) -> None:
        is_picture = self.image.ndim == 2 or (self.image.ndim == 3 and self.image.shape[2] == 3)
        if not is_picture or self.image.dtype != np.uint8:
            raise ValueError(
                "a camera frame is uint8 of shape (height, width) or (height, width, 3), "
                f"got {self.image.dtype} {self.image.shape}"
            )
