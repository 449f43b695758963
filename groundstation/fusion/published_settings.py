"""What the published motion estimators are given: what is not published, and additions of ours, all off."""

import math
from typing import Annotated

from pydantic import ConfigDict, Field

from groundstation.files.amounts import UNITLESS
from groundstation.files.plain_model import PlainModel

_Place = Annotated[float, Field(ge=-100.0, le=100.0)]


class PublishedMotion(PlainModel):
    """Settings of the rows `reintegration`, `stars` and `imu`; in a rig file, `fusion.published`.

    Attributes:
        start_x_m: The rough initial conditions before the first fix; not published.
        start_y_m: Of them.
        start_heading_deg: Of them.
        gate_needs_both: A sample is left out only if accelerations *and* rate are beyond their limits.
        median_zeros: Addition: zeros are the medians of the rest instead of the means.
        takes_exact_steps: Addition: constant acceleration over a sample, along the angle of its middle.
        fills_gated: Addition: a sample that is not used is replaced by the last used one.
        fit_after_s: Addition: so long after take-off the accelerometers' constant offsets are fitted, once.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    start_x_m: _Place = 0.0
    start_y_m: _Place = 0.0
    start_heading_deg: Annotated[float, Field(ge=-360.0, le=360.0)] = 0.0
    gate_needs_both: bool = False
    median_zeros: bool = False
    takes_exact_steps: bool = False
    fills_gated: bool = False
    fit_after_s: Annotated[float, Field(gt=0.0, le=UNITLESS)] | None = None

    @property
    def start_heading_rad(self) -> float:
        """As the estimators take it."""
        return math.radians(self.start_heading_deg)


AS_PUBLISHED = PublishedMotion()
