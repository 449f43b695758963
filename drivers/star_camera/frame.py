"""One picture of the star camera as it reached the host."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, eq=False)
class CameraFrame:
    """A mono picture and the moment it was complete on the host.

    Attributes:
        image: uint8, shape (height, width); row 0 is the top row, x right, y down. Treat as read-only.
        stamp_arrival_ns: Host monotonic clock when the last byte had been read, not the exposure.
        sequence: Counts the pictures of one source, dropped ones included, from 0.
    """

    image: NDArray[np.uint8]
    stamp_arrival_ns: int
    sequence: int

    def __post_init__(self) -> None:
        if self.image.ndim != 2 or self.image.dtype != np.uint8:
            raise ValueError(
                f"a camera frame is uint8 of shape (height, width), got {self.image.dtype} {self.image.shape}"
            )
