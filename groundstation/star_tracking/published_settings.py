"""What the published star methods are given: limits that are not published, and additions of ours."""

import math
from dataclasses import dataclass

LEVEL_RATIO = 0.3
"""Assumed: between the least (0) and the largest (1) intensity of the picture."""


@dataclass(frozen=True, slots=True)
class PublishedSettings:
    """Limits that are not published, and additions of ours, all off.

    Attributes:
        angle_limit_rad: How far each of the two angles may differ.
        closeness_m: How far places of one run may lie apart, along x and along y.
        uses_tree: Addition: triangles are looked up in a k-d tree instead of compared one by one. The answer
            is the same.
        drops_thin: Addition: triangles with an angle above 150 deg are left out.
        only_similar: Addition: only maps without mirror whose singular values agree within a tenth count.
        takes_median: Addition: the median of the run's places and turns in the place of the mean.
    """

    angle_limit_rad: float = math.radians(1.2)
    closeness_m: float = 0.05
    uses_tree: bool = False
    drops_thin: bool = False
    only_similar: bool = False
    takes_median: bool = False

    def __post_init__(self) -> None:
        for name in ("angle_limit_rad", "closeness_m"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be above zero, found {getattr(self, name):g}")


AS_PUBLISHED = PublishedSettings()
