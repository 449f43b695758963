"""The camera on a hull that looks at the other mock-ups: when it exposes, where all are meanwhile."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from drivers.laboratory import ChannelKind
from firmware_emulator.device_kind import DeviceKind, PictureOrder
from firmware_emulator.devices.shutter import PictureSettings, Pose, Shutter, pose_of
from firmware_emulator.failure_kinds import FailureKind, Parameter
from firmware_emulator.failures import Failures
from firmware_emulator.plant.rigid_body import Vehicle
from firmware_emulator.scenario import MockUp, Scenario, Site
from firmware_emulator.settings import Positive


@dataclass(frozen=True, slots=True)
class SideExposure:
    """One picture to be drawn.

    Attributes:
        sequence: Counts the exposures from 0.
        own: Pose of the mock-up that carries the camera when the shutter opened, and when it closed.
        others: The same of the other mock-ups, by name.
        noise: Number that decides the picture's noise; an older one where the camera repeats a picture.
        is_dark: Lamp and markers are off.
        covered_share: Of the picture that a hand covers.
        arrival_ns: When the picture reaches the host.
    """

    sequence: int
    own: tuple[Pose, Pose]
    others: dict[str, tuple[Pose, Pose]]
    noise: int
    is_dark: bool
    covered_share: float
    arrival_ns: int


class SideCameraConfig(PictureSettings):
    """The section `side_camera` of a mock-up: a camera on its hull that looks along the table."""

    camera: str
    """Path of the camera file (JSON)."""
    bodies: str
    """Path of what every mock-up looks like from the side (TOML)."""
    rate_hz: Positive = 15.0
    exposure_s: Positive = 0.004


Places = tuple[Pose, dict[str, Pose]]
"""Of who carries the camera, and of the others by name."""


class SideCamera(Shutter[Places, SideExposure]):
    """Timing of the exposures, and what moves during each.

    Args:
        carrier: The mock-up that carries it.
        others: All that may be seen, by name.
        settings: Rate, exposure, delay.
        failures: Of the carrier: dark, covered, frozen, silent.
        rng: For the jitter.
        start_ns: First exposure begins a third of a period later, between those of the other cameras.
    """

    def __init__(
        self,
        carrier: Vehicle,
        others: Mapping[str, Vehicle],
        settings: SideCameraConfig,
        failures: Failures,
        rng: np.random.Generator,
        start_ns: int,
    ) -> None:
        timing = settings.rate_hz, settings.exposure_s, settings.delay_s, settings.delay_jitter_s
        super().__init__(*timing, rng, start_ns, 1.0 / 3.0)
        self._carrier, self._others, self._failures = carrier, dict(others), failures
        self._frozen: SideExposure | None = None

    def _exposed(self, before: Places, after: Places, middle_ns: int, age_ns: int) -> SideExposure | None:
        del middle_ns
        (own, others), (own_end, ends) = before, after
        covered = self._failures.active("covered_side_camera", age_ns)
        seen = SideExposure(
            self._sequence,
            (own, own_end),
            {name: (others[name], ends[name]) for name in self._others},
            self._sequence,
            self._failures.active("dark_side_view", age_ns) is not None,
            covered.parameters["share"] if covered else 0.0,
            self._last_arrival_ns,
        )
        if self._failures.active("frozen_side_camera", age_ns) is None:
            self._frozen = None
        elif self._frozen is None:
            self._frozen = seen
        if self._frozen is not None:
            seen = replace(self._frozen, sequence=seen.sequence, arrival_ns=seen.arrival_ns)
        return seen if self._failures.active("silent_side_camera", age_ns) is None else None

    def _places(self, now_ns: int) -> Places:
        others = {name: pose_of(vehicle, now_ns) for name, vehicle in self._others.items()}
        return pose_of(self._carrier, now_ns), others


def build(site: Site, mock_up: MockUp, settings: SideCameraConfig) -> SideCamera:
    """The side camera of a mock-up."""
    return SideCamera(
        mock_up.vehicle,
        {other.name: other.vehicle for other in site.mock_ups if other is not mock_up},
        settings,
        mock_up.failures,
        mock_up.random("side_camera"),
        mock_up.start_ns,
    )


def order(scenario: Scenario, index: int, settings: SideCameraConfig) -> PictureOrder:
    """Who draws what the side camera of vehicle `index` sees."""
    config, vehicle = scenario.config, scenario.config.vehicles[index]
    lamp = config.sun_lamp
    return PictureOrder(
        name=f"{vehicle.name}-side",  # no mock-up's name has a hyphen
        renderer="firmware_emulator.devices.side_renderer:SideRenderer",
        arguments={
            "camera": config.path(settings.camera),
            "bodies": config.path(settings.bodies),
            "seen": [other.name for other in config.vehicles if other.name != vehicle.name],
            "lamp_deg": [lamp.azimuth_deg, lamp.elevation_deg],
            "lamp_level_dn": lamp.level_dn,
            "ambient_ratio": lamp.ambient_ratio,
            "seed": [*scenario.seed_words, 1000 + index, vehicle.seed_offset],
        },
        stream=settings.stream,
        jpeg_quality=settings.jpeg_quality,
    )


SIDE_CAMERA = DeviceKind(
    name="side_camera",
    channel=ChannelKind.CAMERA,
    among_others=build,
    section="side_camera",
    settings=SideCameraConfig,
    pictures=order,
    failures={
        "dark_side_view": FailureKind(
            "side_camera", "The side camera sees nothing: sun lamp and markers are off."
        ),
        "covered_side_camera": FailureKind(
            "side_camera",
            "A hand covers a share of the side camera's picture, from the left.",
            {"share": Parameter(1.0, 0.0, 1.0)},
        ),
        "frozen_side_camera": FailureKind("side_camera", "The side camera repeats one picture."),
        "silent_side_camera": FailureKind("side_camera", "The side camera sends nothing."),
    },
)
