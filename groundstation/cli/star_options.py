"""What `star-tracker solve` is asked for, checked."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from groundstation.declarations.errors import UsageError
from groundstation.star_tracking.identifications import IDENTIFICATIONS, IMAGES, SkySettings
from groundstation.star_tracking.published_settings import LEVEL_RATIO, PublishedSettings

PUBLISHED = "published"


@dataclass(frozen=True)
class SkyOptions:
    """Which rows of the tables, and what the published ones are given.

    Attributes:
        method: Row of both tables.
        image: Row of the picture steps, if it is another one.
        identification: Row of the identification, if it is another one.
        level: Of the published picture steps, None for what is assumed.
        angle_limit_deg: Of the published identification, likewise.
        closeness_mm: Of the published identification, likewise.
        added: Which additions of ours are switched on.
    """

    method: str
    image: str | None
    identification: str | None
    level: float | None
    angle_limit_deg: float | None
    closeness_mm: float | None
    added: Mapping[str, bool]

    @property
    def image_row(self) -> str:
        """Of the picture steps."""
        return self.image or self.method

    @property
    def identification_row(self) -> str:
        """Of the identification."""
        return self.identification or self.method

    def check(self) -> None:
        """Refuse what does not go together.

        Raises:
            UsageError: A row that there is not, a value out of bounds, or one that nothing takes.
        """
        for option, row, table in (
            ("--method", self.method, IDENTIFICATIONS),
            ("--image", self.image_row, IMAGES),
            ("--identification", self.identification_row, IDENTIFICATIONS),
        ):
            if row not in table:
                raise UsageError(f"{option} must be one of {', '.join(table)}, found {row!r}.")
        if self.level is not None and not 0.0 < self.level < 1.0:
            raise UsageError(f"--level must lie between 0 and 1, found {self.level:g}.")
        for option, value, most in (
            ("--angle-limit-deg", self.angle_limit_deg, 60.0),
            ("--closeness-mm", self.closeness_mm, 10_000.0),
        ):
            if value is not None and not 0.0 < value <= most:
                raise UsageError(f"{option} must be above zero and at most {most:g}, found {value:g}.")
        if self.level is not None and self.image_row != PUBLISHED:
            raise UsageError("--level goes with --image published.")
        limits = (self.angle_limit_deg, self.closeness_mm)
        if self.identification_row != PUBLISHED and (
            any(self.added.values()) or any(each is not None for each in limits)
        ):
            raise UsageError("limits and additions go with --identification published.")

    @cached_property
    def settings(self) -> SkySettings:
        """What the rows are given."""
        limits = {
            "angle_limit_deg": self.angle_limit_deg,
            "closeness_m": None if self.closeness_mm is None else 1e-3 * self.closeness_mm,
        }
        given = {name: value for name, value in limits.items() if value is not None}
        published = PublishedSettings.model_validate({**given, **self.added})
        level = LEVEL_RATIO if self.level is None else self.level
        return SkySettings(published=published, level_ratio=level)
