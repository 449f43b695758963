"""Every way from a picture to a fix that a rig or a command can name: one row for each half.

The first half finds light spots in a picture, the second finds the ceiling in the spots. What a row needs
is imported where the row is used: a rig is read by processes that see no picture.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.fixes import BodyMotion, NoFix, PictureFix, PosePrior
from groundstation.star_tracking.published_settings import AS_PUBLISHED, LEVEL_RATIO, PublishedSettings
from groundstation.star_tracking.star_catalogue import StarCatalogue
from groundstation.star_tracking.tracker_settings import TrackerSettings

FindSpots = Callable[[NDArray[np.uint8]], Spots]


class Solver(Protocol):
    """Light spots of one picture in, its pose or the reason for none out."""

    def solve(
        self, spots: Spots, prior: PosePrior | None = None, motion: BodyMotion | None = None
    ) -> PictureFix | NoFix:
        """Give the pose at the exposure, or say why there is none."""


@dataclass(frozen=True, slots=True)
class SkySettings:
    """Settings of every row; each takes what it knows.

    Attributes:
        tracker: Of the default identification.
        published: Of the published one.
        level_ratio: Of the published picture steps.
    """

    tracker: TrackerSettings = field(default_factory=TrackerSettings)
    published: PublishedSettings = AS_PUBLISHED
    level_ratio: float = LEVEL_RATIO


def _default_spots(settings: SkySettings) -> FindSpots:
    from groundstation.star_tracking.detection import Detector

    del settings
    return Detector().find


def _published_spots(settings: SkySettings) -> FindSpots:
    from groundstation.star_tracking.published_image import published_spots

    return lambda image: published_spots(image, settings.level_ratio)


def _default(catalogue: StarCatalogue, camera: CameraCalibration, settings: SkySettings) -> Solver:
    from groundstation.star_tracking.tracker import StarTracker

    return StarTracker(catalogue, camera, settings.tracker)


def _published(catalogue: StarCatalogue, camera: CameraCalibration, settings: SkySettings) -> Solver:
    from groundstation.star_tracking.published import PublishedTracker

    return PublishedTracker(catalogue, camera, settings.published)


IMAGES: Mapping[str, Callable[[SkySettings], FindSpots]] = MappingProxyType(
    {"default": _default_spots, "published": _published_spots}
)
"""From a picture to light spots."""
IDENTIFICATIONS: Mapping[str, Callable[[StarCatalogue, CameraCalibration, SkySettings], Solver]] = (
    MappingProxyType({"default": _default, "published": _published})
)
"""From light spots to the pose."""
