"""Keys of a rig file for star cameras and for streams of fixes."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from groundstation.declarations.rig_file import RigFile
from groundstation.declarations.section import Delay, Positive, Section, Sigma
from groundstation.star_tracking.identifications import IDENTIFICATIONS, IMAGES, SkySettings
from groundstation.star_tracking.published_settings import LEVEL_RATIO, PublishedSettings
from groundstation.star_tracking.stamp_delay import parse_delay
from groundstation.star_tracking.tracker_settings import TrackerSettings


class PublishedStarsSection(Section, PublishedSettings):
    """What the published methods are given: the level of the picture steps, and the identification's."""

    level_ratio: Annotated[float, Field(gt=0.0, lt=1.0)] = LEVEL_RATIO


class StarCameraSection(Section):
    """The star camera: calibration files, delay from exposure to arrival, floor of its errors.

    ``delay_file`` is what `calibrate delay` wrote; it stands for ``delay_s`` and ``delay_sigma_s``.
    ``image`` and ``identification`` name how a picture becomes spots, and spots a pose; ``published`` holds
    what the published ones are given.
    """

    camera: RigFile
    ceiling: RigFile
    delay_s: Delay = 0.0
    delay_sigma_s: Delay = 0.002
    delay_file: RigFile | None = None
    timeout_s: Positive = 2.0
    exposure_s: Delay = 0.0
    readout_s: Delay = 0.0
    sigma_xy_m: Sigma = 0.001
    sigma_heading_rad: Sigma = 0.0009
    image: str = "default"
    identification: str = "default"
    published: PublishedStarsSection = PublishedStarsSection()

    @model_validator(mode="after")
    def _known(self) -> Self:
        for key, table in (("image", IMAGES), ("identification", IDENTIFICATIONS)):
            if getattr(self, key) not in table:
                raise ValueError(f"{key} {getattr(self, key)!r} is none of {', '.join(table)}")
        return self

    @model_validator(mode="before")
    @classmethod
    def _one_delay(cls, given: object) -> object:
        """Refused before the file is looked for: which of the two was meant decides if it must exist."""
        if isinstance(given, dict) and "delay_file" in given and given.keys() & {"delay_s", "delay_sigma_s"}:
            raise ValueError("give either 'delay_file' or 'delay_s' and 'delay_sigma_s'")
        return given

    @property
    def delay(self) -> tuple[float, float]:
        """From the middle of the exposure to the picture's stamp, and its standard deviation, s."""
        if self.delay_file is None:
            return self.delay_s, self.delay_sigma_s
        found = self.delay_file.value(parse_delay)
        return found.delay_s, found.sigma_s

    @property
    def sky_settings(self) -> SkySettings:
        """What the rows of the tables of star tracking are given."""
        tracker = TrackerSettings(exposure_s=self.exposure_s, readout_s=self.readout_s)
        return SkySettings(tracker, self.published, self.published.level_ratio)


class StarsOfType(Section):
    """Keys of a type of mock-up."""

    star_camera: StarCameraSection | None = None


class StarsOfVehicle(Section):
    """Keys of a vehicle: where its camera is opened, or a stream of poses that stands in for it."""

    star_camera: str | None = None
    fixes: str | None = None

    @property
    def has_stars(self) -> bool:
        """Whether star fixes are made, or drawn in their place."""
        return self.star_camera is not None or self.fixes is not None

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if self.star_camera is not None and self.fixes is not None:
            raise ValueError("needs only one of 'star_camera' and 'fixes'")
        return self
