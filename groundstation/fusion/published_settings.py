"""What the published motion estimators are given: what is not published, and additions of ours, all off."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class PublishedMotion:
    """Settings of the rows `reintegration`, `stars` and `imu`.

    Attributes:
        start_x_m: The rough initial conditions before the first fix; not published.
        start_y_m: Of them.
        start_heading_rad: Of them.
        gate_needs_both: A sample is left out only if accelerations *and* rate are beyond their limits.
        median_zeros: Addition: zeros are the medians of the rest instead of the means.
        takes_exact_steps: Addition: constant acceleration over a sample, along the angle of its middle.
        fills_gated: Addition: a sample that is not used is replaced by the last used one.
        fit_after_s: Addition: so long after take-off the accelerometers' constant offsets are fitted, once.
    """

    start_x_m: float = 0.0
    start_y_m: float = 0.0
    start_heading_rad: float = 0.0
    gate_needs_both: bool = False
    median_zeros: bool = False
    takes_exact_steps: bool = False
    fills_gated: bool = False
    fit_after_s: float | None = None

    def __post_init__(self) -> None:
        for name in ("start_x_m", "start_y_m", "start_heading_rad"):
            if not math.isfinite(getattr(self, name)):
                raise ValueError(f"{name} must be a number, found {getattr(self, name)!r}")
        if self.fit_after_s is not None and not 0.0 < self.fit_after_s < math.inf:
            raise ValueError(f"fit_after_s must be above zero, found {self.fit_after_s!r}")


AS_PUBLISHED = PublishedMotion()
