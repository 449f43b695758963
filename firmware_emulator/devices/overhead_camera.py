"""The camera over the table: when it exposes, where every vehicle is meanwhile, when the picture arrives."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drivers.laboratory import ChannelKind
from firmware_emulator.device_kind import DeviceKind, PictureOrder
from firmware_emulator.devices.shutter import PictureSettings, Pose, Shutter, pose_of
from firmware_emulator.failures import Failures
from firmware_emulator.plant.rigid_body import Vehicle
from firmware_emulator.scenario import Scenario, Site
from firmware_emulator.settings import Positive


@dataclass(frozen=True, slots=True)
class TableExposure:
    """One picture of the table to be drawn.

    Attributes:
        sequence: Counts the exposures from 0.
        paths: Of each vehicle: pose when the shutter opened, and when it closed.
        hidden: How many discs of a vehicle hands cover.
        arrival_ns: When the picture reaches the host.
    """

    sequence: int
    paths: dict[str, tuple[Pose, Pose]]
    hidden: dict[str, int]
    arrival_ns: int


class OverheadConfig(PictureSettings):
    """The camera over the table that looks down: one for the laboratory."""

    camera: str
    """Path of the camera file (JSON)."""
    circles: str
    """Path of what each mock-up wears (TOML)."""
    rate_hz: Positive = 10.0
    exposure_s: Positive = 0.01


class OverheadCamera(Shutter[dict[str, Pose], TableExposure]):
    """Timing of the exposures, and what moves during each.

    Args:
        vehicles: All that may be seen, by name.
        settings: Rate, exposure, delay.
        failures: Of each vehicle: `hidden_discs`.
        rng: For the jitter.
        start_ns: First exposure begins half a period later, between those of star cameras of the same rate.
    """

    def __init__(
        self,
        vehicles: Mapping[str, Vehicle],
        settings: OverheadConfig,
        failures: Mapping[str, Failures],
        rng: np.random.Generator,
        start_ns: int,
    ) -> None:
        timing = settings.rate_hz, settings.exposure_s, settings.delay_s, settings.delay_jitter_s
        super().__init__(*timing, rng, start_ns, 0.5)
        self._vehicles, self._failures = dict(vehicles), dict(failures)

    def _places(self, now_ns: int) -> dict[str, Pose]:
        return {name: pose_of(vehicle, now_ns) for name, vehicle in self._vehicles.items()}

    def _exposed(
        self, before: dict[str, Pose], after: dict[str, Pose], middle_ns: int, age_ns: int
    ) -> TableExposure:
        del middle_ns
        paths = {name: (before[name], after[name]) for name in self._vehicles}
        return TableExposure(self._sequence, paths, self._hidden(age_ns), self._last_arrival_ns)

    def _hidden(self, age_ns: int) -> dict[str, int]:
        found = {}
        for name, failures in self._failures.items():
            failure = failures.active("hidden_discs", age_ns)
            if failure is not None:
                found[name] = int(failure.parameters["count"])
        return found


def build(site: Site, settings: OverheadConfig) -> OverheadCamera:
    """The camera over the table."""
    return OverheadCamera(
        {mock_up.name: mock_up.vehicle for mock_up in site.mock_ups},
        settings,
        {mock_up.name: mock_up.failures for mock_up in site.mock_ups},
        site.scenario.random("overhead_camera"),
        site.scenario.start_ns,
    )


def order(scenario: Scenario, index: int, settings: OverheadConfig) -> PictureOrder:
    """Who draws the table."""
    config = scenario.config
    return PictureOrder(
        name="overhead_camera",
        renderer="firmware_emulator.devices.table_renderer:TableRenderer",
        arguments={
            "camera": config.path(settings.camera),
            "circles": config.path(settings.circles),
            "bounds_m": list(config.table.bounds_m),
            "radii_m": {vehicle.name: vehicle.radius_m for vehicle in config.vehicles},
            "seed": [*scenario.seed_words, len(config.vehicles) + 1],
        },
        stream=settings.stream,
        jpeg_quality=settings.jpeg_quality,
    )


OVERHEAD_CAMERA = DeviceKind(
    name="overhead_camera",
    channel=ChannelKind.CAMERA,
    per_laboratory=build,
    section="overhead",
    settings=OverheadConfig,
    pictures=order,
)
