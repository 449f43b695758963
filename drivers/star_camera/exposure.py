"""When a picture was taken, from when it arrived."""

import math
from dataclasses import dataclass

_NS_PER_S = 1_000_000_000


@dataclass(frozen=True, slots=True)
class ExposureDelay:
    """Span from the middle of the exposure to the picture's stamp: its driver's, else its arrival.

    Attributes:
        delay_s: Exposure's half, read-out, transfer and decoding in the camera; from the rig or calibration.
        delay_sigma_s: Its uncertainty for one picture, jitter included.
    """

    delay_s: float
    delay_sigma_s: float

    def __post_init__(self) -> None:
        for name in ("delay_s", "delay_sigma_s"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} is a span of at least 0 s, got {value}")

    def middle_ns(self, stamp_ns: int) -> int:
        """Stamp of the middle of the exposure; uncertain by `delay_sigma_s`."""
        return stamp_ns - round(self.delay_s * _NS_PER_S)
