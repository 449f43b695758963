"""The camera over the table: when it exposes, where every vehicle is meanwhile, when the picture arrives."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from drivers.laboratory import ChannelKind
from firmware_emulator.device_kind import DeviceKind, PictureOrder
from firmware_emulator.devices.pending import take_until
from firmware_emulator.devices.star_camera import Pose
from firmware_emulator.failures import Failures
from firmware_emulator.plant.rigid_body import Vehicle
from firmware_emulator.plant.thrusters import NS_PER_S
from firmware_emulator.scenario import Scenario, Site
from firmware_emulator.settings import NonNegative, Positive, Settings

_JITTER_LIMIT = 6.0  # standard deviations


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


class OverheadConfig(Settings):
    """The camera over the table that looks down: one for the laboratory."""

    camera: str
    """Path of the camera file (JSON)."""
    circles: str
    """Path of what each mock-up wears (TOML)."""
    rate_hz: Positive = 10.0
    exposure_s: Positive = 0.01
    delay_s: Annotated[float, Field(ge=0.0, le=4.0)] = 0.02
    """From the middle of the exposure to the host."""
    delay_jitter_s: NonNegative = 0.001
    stream: Literal["raw", "mjpeg"] = "raw"
    """How live pictures are served over HTTP."""
    jpeg_quality: Annotated[int, Field(ge=1, le=100)] = 95

    @model_validator(mode="after")
    def _exposure_fits_the_rate(self) -> "OverheadConfig":
        if self.exposure_s * self.rate_hz >= 1.0:
            raise ValueError(
                f"exposure_s = {self.exposure_s:g} s is longer than a period of rate_hz = {self.rate_hz:g}"
            )
        return self


class OverheadCamera:
    """Timing of the exposures, and what moves during each.

    Args:
        vehicles: All that may be seen, by name.
        rate_hz: Pictures per second.
        exposure_s: How long a picture is exposed, all rows at once.
        delay_s: From the middle of the exposure until the picture is at the host.
        delay_jitter_s: Its standard deviation.
        failures: Of each vehicle: `hidden_discs`.
        rng: For the jitter.
        start_ns: First exposure begins half a period later, between those of star cameras of the same rate.
    """

    def __init__(
        self,
        vehicles: Mapping[str, Vehicle],
        rate_hz: float,
        exposure_s: float,
        delay_s: float,
        delay_jitter_s: float,
        failures: Mapping[str, Failures],
        rng: np.random.Generator,
        start_ns: int,
    ) -> None:
        self._vehicles, self._failures = dict(vehicles), dict(failures)
        self._period_ns = round(NS_PER_S / rate_hz)
        self._open_ns = round(exposure_s * NS_PER_S)
        self._delay_ns = round(delay_s * NS_PER_S)
        self._jitter_ns = delay_jitter_s * NS_PER_S
        self._rng, self._start_ns = rng, start_ns
        self._opens_ns = start_ns + self._period_ns // 2
        self._starts: dict[str, Pose] | None = None
        self._sequence = 0
        self._last_arrival_ns = 0
        self._pending: deque[tuple[int, TableExposure]] = deque()

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
        starts, ends = self._starts, self._poses(now_ns)
        self._starts = None
        middle_ns = self._opens_ns + self._open_ns // 2
        self._opens_ns += self._period_ns
        jitter = float(np.clip(self._rng.standard_normal(), -_JITTER_LIMIT, _JITTER_LIMIT))
        arrival_ns = max(now_ns, middle_ns + self._delay_ns + round(jitter * self._jitter_ns))
        self._last_arrival_ns = max(self._last_arrival_ns + 1, arrival_ns)
        exposure = TableExposure(
            self._sequence,
            {name: (starts[name], ends[name]) for name in self._vehicles},
            self._hidden(middle_ns - self._start_ns),
            self._last_arrival_ns,
        )
        self._sequence += 1
        self._pending.append((exposure.arrival_ns, exposure))

    def take(self, until_ns: int) -> list[tuple[int, TableExposure]]:
        """Exposures whose pictures reached the host up to `until_ns`."""
        return take_until(self._pending, until_ns)

    def take_exposed(self) -> list[TableExposure]:
        """Exposures taken so far, ahead of their arrival: for one who draws them elsewhere."""
        taken = [exposure for _, exposure in self._pending]
        self._pending.clear()
        return taken

    def _poses(self, now_ns: int) -> dict[str, Pose]:
        motions = {name: vehicle.origin_at(now_ns) for name, vehicle in self._vehicles.items()}
        return {name: (motion.x_m, motion.y_m, motion.heading_rad) for name, motion in motions.items()}

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
        settings.rate_hz,
        settings.exposure_s,
        settings.delay_s,
        settings.delay_jitter_s,
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
