"""The camera on a hull that looks at the other mock-ups: when it exposes, where all are meanwhile."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from drivers.laboratory import ChannelKind
from firmware_emulator.device_kind import DeviceKind, PictureOrder
from firmware_emulator.devices.pending import take_until
from firmware_emulator.devices.star_camera import Pose
from firmware_emulator.failure_kinds import FailureKind, Parameter
from firmware_emulator.failures import Failures
from firmware_emulator.plant.rigid_body import Vehicle
from firmware_emulator.plant.thrusters import NS_PER_S
from firmware_emulator.scenario import MockUp, Scenario, Site
from firmware_emulator.settings import NonNegative, Positive, Settings

_JITTER_LIMIT = 6.0  # standard deviations


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


class SideCameraConfig(Settings):
    """The section `side_camera` of a mock-up: a camera on its hull that looks along the table."""

    camera: str
    """Path of the camera file (JSON)."""
    bodies: str
    """Path of what every mock-up looks like from the side (TOML)."""
    rate_hz: Positive = 15.0
    exposure_s: Positive = 0.004
    delay_s: Annotated[float, Field(ge=0.0, le=4.0)] = 0.02
    """From the middle of the exposure to the host."""
    delay_jitter_s: NonNegative = 0.001
    stream: Literal["raw", "mjpeg"] = "raw"
    """How live pictures are served over HTTP."""
    jpeg_quality: Annotated[int, Field(ge=1, le=100)] = 95

    @model_validator(mode="after")
    def _exposure_fits_the_rate(self) -> "SideCameraConfig":
        if self.exposure_s * self.rate_hz >= 1.0:
            raise ValueError(
                f"exposure_s = {self.exposure_s:g} s is longer than a period of rate_hz = {self.rate_hz:g}"
            )
        return self


class SideCamera:
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
        self._carrier, self._others, self._failures = carrier, dict(others), failures
        self._period_ns = round(NS_PER_S / settings.rate_hz)
        self._open_ns = round(settings.exposure_s * NS_PER_S)
        self._delay_ns = round(settings.delay_s * NS_PER_S)
        self._jitter_ns = settings.delay_jitter_s * NS_PER_S
        self._rng, self._start_ns = rng, start_ns
        self._opens_ns = start_ns + self._period_ns // 3
        self._starts: tuple[Pose, dict[str, Pose]] | None = None
        self._frozen: SideExposure | None = None
        self._sequence = 0
        self._last_arrival_ns = 0
        self._pending: deque[tuple[int, SideExposure]] = deque()

    @property
    def next_ns(self) -> int:
        """When the shutter next moves."""
        return self._opens_ns if self._starts is None else self._opens_ns + self._open_ns

    @property
    def next_output_ns(self) -> int:
        """When the next picture may reach the host."""
        if self._pending:
            return self._pending[0][0]
        early_ns = self._opens_ns + self._open_ns // 2 + self._delay_ns
        return max(self._opens_ns + self._open_ns, early_ns - round(_JITTER_LIMIT * self._jitter_ns))

    def run(self, now_ns: int) -> None:
        """Open or close the shutter."""
        if self._starts is None:
            self._starts = self._poses(now_ns)
            return
        (own, others), (own_end, ends) = self._starts, self._poses(now_ns)
        self._starts = None
        middle_ns = self._opens_ns + self._open_ns // 2
        self._opens_ns += self._period_ns
        jitter = float(np.clip(self._rng.standard_normal(), -_JITTER_LIMIT, _JITTER_LIMIT))
        arrival_ns = max(now_ns, middle_ns + self._delay_ns + round(jitter * self._jitter_ns))
        self._last_arrival_ns = max(self._last_arrival_ns + 1, arrival_ns)
        age_ns = middle_ns - self._start_ns
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
        self._sequence += 1
        if self._failures.active("frozen_side_camera", age_ns) is None:
            self._frozen = None
        elif self._frozen is None:
            self._frozen = seen
        if self._frozen is not None:
            seen = replace(self._frozen, sequence=seen.sequence, arrival_ns=seen.arrival_ns)
        if self._failures.active("silent_side_camera", age_ns) is None:
            self._pending.append((seen.arrival_ns, seen))

    def take(self, until_ns: int) -> list[tuple[int, SideExposure]]:
        """Exposures whose pictures reached the host up to `until_ns`."""
        return take_until(self._pending, until_ns)

    def take_exposed(self) -> list[SideExposure]:
        """Exposures taken so far, ahead of their arrival: for one who draws them elsewhere."""
        taken = [exposure for _, exposure in self._pending]
        self._pending.clear()
        return taken

    def _poses(self, now_ns: int) -> tuple[Pose, dict[str, Pose]]:
        return _pose(self._carrier, now_ns), {
            name: _pose(vehicle, now_ns) for name, vehicle in self._others.items()
        }


def _pose(vehicle: Vehicle, now_ns: int) -> Pose:
    motion = vehicle.origin_at(now_ns)
    return motion.x_m, motion.y_m, motion.heading_rad


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
