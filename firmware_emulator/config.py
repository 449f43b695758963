"""The scenario of an emulated laboratory, as the rig's `[laboratory]` table states it.

The rig file speaks degrees where people do (`_deg` in the key); everything past this file is SI and
radians. Unknown keys are refused.
"""

import math
from pathlib import Path
from typing import Annotated

from pydantic import AliasChoices, Field, ValidationInfo, model_validator

from drivers.files.reading import path_of
from drivers.valve_bus.protocol import MAX_VEHICLES
from firmware_emulator.applicability import why_not
from firmware_emulator.failures import FAILURE_KINDS, FailureConfig
from firmware_emulator.mock_up_config import VehicleConfig
from firmware_emulator.settings import Fraction, NonNegative, Positive, Settings

Slope = Annotated[float, Field(ge=-0.1, le=0.1)]
"""No mock-up stays on a table that leans by more."""


class TableConfig(Settings):
    """The air table and the floor under it."""

    bounds_m: tuple[float, float, float, float] = (-2.0, 2.0, -1.5, 1.5)
    """x_min, x_max, y_min, y_max of the table's surface, table frame."""
    tilt_rad: tuple[Slope, Slope] = (0.0, 0.0)
    """Mean gradient of the surface's height along table x and y; 0.3 mrad gives 3 mm/s^2."""
    waviness_rad: NonNegative = 5e-5
    """Standard deviation of the local gradient about the mean one, per axis."""
    waviness_length_m: Positive = 0.8
    """Shortest wavelength of the waves; the longest is four times as long."""
    friction_landed: Positive = 0.3
    """Coefficient of dry friction of a landed vehicle."""
    edge_restitution: Fraction = 0.5
    contact_restitution: Fraction = 0.5
    """Of two vehicles that touch."""
    floor_pulse_rate_hz: NonNegative = 0.0
    """Mean rate of shocks through the floor (a door, a trolley), at random moments."""
    floor_pulse_m_s2: NonNegative = 0.01
    """Standard deviation of a shock's acceleration, per axis."""
    floor_pulse_s: Positive = 0.06

    @model_validator(mode="after")
    def _bounds_are_ordered(self) -> "TableConfig":
        x_min, x_max, y_min, y_max = self.bounds_m
        if x_min >= x_max or y_min >= y_max:
            raise ValueError("bounds_m must be x_min, x_max, y_min, y_max with min below max")
        return self


class SunLampConfig(Settings):
    """The lamp that stands for the Sun: it lights what side cameras look at."""

    azimuth_deg: Annotated[float, Field(ge=-360.0, le=360.0)] = 60.0
    """Direction towards the lamp in the table, counter-clockwise from +x."""
    elevation_deg: Annotated[float, Field(ge=0.0, le=80.0)] = 15.0
    level_dn: Annotated[float, Field(ge=0.0, le=2000.0)] = 200.0
    """Grey level of a white surface that faces the lamp; 0: it is off."""
    ambient_ratio: Fraction = 0.0
    """What comes from everywhere else, as a share of that."""


class LaboratoryConfig(Settings):
    """The `[laboratory]` table, beside the sections of devices (`device_table.read_config`)."""

    name: str = "emulator"
    """The entry point that made this laboratory."""
    folder: str = ""
    """Where relative paths start: the rig file's folder, filled in by who reads the rig; else the current."""
    seed: Annotated[int, Field(ge=0)] = 0
    table: TableConfig = TableConfig()
    sun_lamp: SunLampConfig = SunLampConfig()
    vehicles: Annotated[tuple[VehicleConfig, ...], Field(min_length=1, max_length=MAX_VEHICLES)]
    failures: Annotated[
        tuple[FailureConfig, ...], Field(validation_alias=AliasChoices("failures", "faults"))
    ] = ()
    """What is injected, and when; `faults`, its older name, is still read."""
    bus_bitrate: Positive = 500_000.0

    def path(self, path: str) -> str:
        """A path of the scenario as seen from here."""
        return str(Path(self.folder) / path_of(path))

    @model_validator(mode="after")
    def _names_are_unique_and_known(self) -> "LaboratoryConfig":
        names = [vehicle.name for vehicle in self.vehicles]
        if len(set(names)) != len(names):
            raise ValueError(f"vehicles must have different names, got {', '.join(names)}")
        for failure in self.failures:
            if failure.vehicle not in names:
                raise ValueError(
                    f"failure {failure.kind!r} names vehicle {failure.vehicle!r}; there are {names}"
                )
        return self

    @model_validator(mode="after")
    def _failures_find_what_they_befall(self, info: ValidationInfo) -> "LaboratoryConfig":
        kinds = (info.context or {}).get("failure_kinds", FAILURE_KINDS)
        by_name = {vehicle.name: vehicle for vehicle in self.vehicles}
        for failure in self.failures:
            reason = why_not(failure.kind, kinds[failure.kind], by_name[failure.vehicle], self)
            if reason:
                raise ValueError(f"failure {failure.kind!r} of {failure.vehicle!r} cannot happen: {reason}")
        return self

    @model_validator(mode="after")
    def _vehicles_stand_on_the_table(self) -> "LaboratoryConfig":
        x_min, x_max, y_min, y_max = self.table.bounds_m
        for index, vehicle in enumerate(self.vehicles):
            x_m, y_m = vehicle.start_m
            if not (x_min <= x_m <= x_max and y_min <= y_m <= y_max):
                raise ValueError(
                    f"start_m of vehicle {vehicle.name!r}, {x_m}, {y_m}, lies outside the table's bounds_m"
                )
            for other in self.vehicles[:index]:
                apart_m = math.dist(vehicle.start_m, other.start_m)
                if apart_m < vehicle.radius_m + other.radius_m:
                    raise ValueError(
                        f"start_m of vehicles {other.name!r} and {vehicle.name!r}, {apart_m:.2f} m apart, "
                        "lets their bumpers overlap"
                    )
        return self
