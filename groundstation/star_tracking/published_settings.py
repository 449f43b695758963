"""What the published star methods are given: limits that are not published, and additions of ours."""

import math
from typing import Annotated

from pydantic import ConfigDict, Field

from groundstation.files.plain_model import PlainModel

LEVEL_RATIO = 0.3
"""Assumed: between the least (0) and the largest (1) intensity of the picture."""


class PublishedSettings(PlainModel):
    """Limits that are not published, and additions of ours, all off; in a rig file, `star_camera.published`.

    Attributes:
        angle_limit_deg: How far each of the two angles may differ.
        closeness_m: How far places of one run may lie apart, along x and along y.
        uses_tree: Addition: triangles are looked up in a k-d tree instead of compared one by one. The answer
            is the same.
        drops_thin: Addition: triangles with an angle above 150 deg are left out.
        only_similar: Addition: only maps without mirror whose singular values agree within a tenth count.
        takes_median: Addition: the median of the run's places and turns in the place of the mean.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    angle_limit_deg: Annotated[float, Field(gt=0.0, le=60.0)] = 1.2
    closeness_m: Annotated[float, Field(gt=0.0, le=10.0)] = 0.05
    uses_tree: bool = False
    drops_thin: bool = False
    only_similar: bool = False
    takes_median: bool = False

    @property
    def angle_limit_rad(self) -> float:
        """As angles are compared."""
        return math.radians(self.angle_limit_deg)


AS_PUBLISHED = PublishedSettings()
