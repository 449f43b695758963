"""Keys of a rig file for estimators."""

from typing import Self

from pydantic import model_validator

from groundstation.declarations.rig import Rig
from groundstation.declarations.section import Positive, Section
from groundstation.fusion.estimators import ESTIMATORS, PUBLISHED
from groundstation.fusion.published_settings import PublishedMotion


class PublishedFusionSection(Section, PublishedMotion):
    """What the published estimators are given beside what is published, and additions of ours, all off."""


class FusionSection(Section):
    """Which estimator, what the published ones are given, and how long the rest at the start must be."""

    method: str = "filter"
    rest_s: Positive = 8.0
    published: PublishedFusionSection = PublishedFusionSection()

    @model_validator(mode="after")
    def _known(self) -> Self:
        if self.method not in ESTIMATORS:
            raise ValueError(f"method {self.method!r} is none of {', '.join(sorted(ESTIMATORS))}")
        if self.method not in PUBLISHED and self.published != PublishedFusionSection():
            raise ValueError(f"published is for the methods {', '.join(PUBLISHED)}, not for {self.method!r}")
        return self


class FusionOfType(Section):
    """Keys of a type of mock-up."""

    fusion: FusionSection = FusionSection()


class FusionOfVehicle(Section):
    """Keys of a vehicle: whose fixes its estimator takes; the first source that it has, if none is named."""

    fix_sources: tuple[str, ...] = ()


def fused_sources(rig: Rig, vehicle: str) -> tuple[str, ...]:
    """Return whose fixes a vehicle's estimator takes: those named, else the first source that it has."""
    named = rig.vehicle(vehicle, FusionOfVehicle).fix_sources
    if named:
        return named
    every = rig.tables.fix_sources.values()
    return tuple(source.name for source in every if source.condition(rig, vehicle))[:1]
