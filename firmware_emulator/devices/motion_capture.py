"""A motion-capture system around the table: what its cameras make of every mock-up, frame by frame.

Poses come in the system's own frame, which lies otherwise than the table's as the scenario states; they are
noisy, late, and missing while something stands between. In lockstep they are what the driver makes of them
(`drivers.motion_capture.pose`), live they go out as the wire's bytes (`firmware_emulator.live.natnet`).
"""

import math
from collections import deque
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from drivers.laboratory import ChannelKind
from drivers.motion_capture.pose import MotionCapturePose
from firmware_emulator.device_kind import DeviceKind
from firmware_emulator.devices.pending import take_until
from firmware_emulator.devices.quaternions import Quaternion, Triple, about_z, inverse, small, times, turned
from firmware_emulator.failures import NS_PER_S, FailureKind
from firmware_emulator.scenario import MockUp, Site
from firmware_emulator.scene_files import SceneError
from firmware_emulator.settings import NonNegative, Positive, Settings

_JITTER_LIMIT = 6.0  # standard deviations
_HALF_ROOT = math.sqrt(0.5)
_UP: dict[str, Quaternion] = {"z": (0.0, 0.0, 0.0, 1.0), "y": (-_HALF_ROOT, 0.0, 0.0, _HALF_ROOT)}
"""Turns z-up axes into the system's: with y up, its z points along -y of the table."""


class MotionCaptureConfig(Settings):
    """The system: its rate and errors, and how its frame lies to the table."""

    rate_hz: Annotated[float, Field(gt=0.0, le=1000.0)] = 100.0
    delay_s: Annotated[float, Field(ge=0.0, le=4.0)] = 0.008
    """From the exposure to the host."""
    delay_jitter_s: NonNegative = 0.0005
    sigma_m: NonNegative = 0.0002
    """Standard deviation of a position, per axis."""
    sigma_rad: NonNegative = 0.0005
    """Standard deviation of an orientation, about each axis."""
    occlusion_rate_hz: NonNegative = 0.0
    """Mean rate of gaps, of each body on its own, at random moments."""
    occlusion_s: Positive = 0.3
    """Mean length of a gap, exponentially distributed."""
    up: Literal["z", "y"] = "z"
    """Which axis of the system points up; OptiTrack's software takes y by default."""
    origin_table_m: Triple = (0.0, 0.0, 0.0)
    """Where the system's origin lies, table frame, z above the table's surface."""
    yaw_deg: float = 0.0
    """By how much the system's x axis is turned from table x, counter-clockwise seen from above."""
    pivot_body_m: Triple = (0.0, 0.0, 0.3)
    """Where the tracked point sits on each mock-up, body frame, z above the table's surface."""
    pivot_yaw_deg: float = 0.0
    """By how much a tracked body's x axis is turned from the mock-up's, counter-clockwise."""
    names: dict[str, str] = Field(default_factory=dict)
    """Vehicle to the name of its rigid body; a vehicle's own name where it is left out."""

    @model_validator(mode="after")
    def _names_fit_the_wire(self) -> "MotionCaptureConfig":
        for name in self.names.values():
            if not name or not name.isprintable() or len(name.encode()) > _LONGEST_NAME_BYTES:
                raise ValueError(f"names: {name!r} is no name of 1 to {_LONGEST_NAME_BYTES} bytes")
        return self

    def body_name(self, vehicle: str) -> str:
        """What the system calls a vehicle."""
        return self.names.get(vehicle, vehicle)


_LONGEST_NAME_BYTES = 255


@dataclass(slots=True)
class _Occlusion:
    """Gaps of one body: when it is hidden next, and until when."""

    rate_hz: float
    mean_s: float
    rng: np.random.Generator
    begins_ns: float
    ends_ns: float = 0.0

    def is_hidden(self, stamp_ns: int) -> bool:
        """Whether the body is hidden; asked at ascending stamps."""
        while self.rate_hz > 0.0 and self.begins_ns <= stamp_ns:
            self.ends_ns = self.begins_ns + self.rng.exponential(self.mean_s) * NS_PER_S
            self.begins_ns = self.ends_ns + self.rng.exponential(1.0 / self.rate_hz) * NS_PER_S
        return stamp_ns < self.ends_ns


class MotionCapture:
    """Looks at all mock-ups once a period.

    Args:
        mock_ups: What it sees.
        settings: The system's.
        rng: For the delay; each body has random numbers of its own.
        start_ns: First frame one period later.
    """

    def __init__(
        self,
        mock_ups: tuple[MockUp, ...],
        settings: MotionCaptureConfig,
        rng: np.random.Generator,
        start_ns: int,
    ) -> None:
        self._mock_ups, self._settings, self._rng = mock_ups, settings, rng
        self._random = [mock_up.random("motion_capture") for mock_up in mock_ups]
        self._occlusions = [_occlusion(mock_up, settings) for mock_up in mock_ups]
        self._start_ns = start_ns
        self._frames = 0
        self._capture_from_table = times(_UP[settings.up], about_z(-math.radians(settings.yaw_deg)))
        self._up_from_system = inverse(_UP[settings.up])
        self._delay_ns = round(settings.delay_s * NS_PER_S)
        self._last_arrival_ns = 0
        self._pending: deque[tuple[int, MotionCapturePose]] = deque()

    @property
    def next_ns(self) -> int:
        """When the cameras next expose."""
        return self._start_ns + round((self._frames + 1) * NS_PER_S / self._settings.rate_hz)

    @property
    def next_output_ns(self) -> int:
        """When the next poses may reach the host."""
        if self._pending:
            return self._pending[0][0]
        early_ns = self._delay_ns - round(_JITTER_LIMIT * self._settings.delay_jitter_s * NS_PER_S)
        return self.next_ns + max(0, early_ns)

    def take(self, until_ns: int) -> list[tuple[int, MotionCapturePose]]:
        """Poses that reached the host up to `until_ns`; all of a frame together."""
        return take_until(self._pending, until_ns)

    def run(self, now_ns: int) -> None:
        """Expose a frame."""
        jitter = float(np.clip(self._rng.standard_normal(), -_JITTER_LIMIT, _JITTER_LIMIT))
        late_ns = max(0, self._delay_ns + round(jitter * self._settings.delay_jitter_s * NS_PER_S))
        self._last_arrival_ns = max(self._last_arrival_ns + 1, now_ns + late_ns)
        for index in range(len(self._mock_ups)):
            self._pending.append((self._last_arrival_ns, self._pose(index, now_ns)))
        self._frames += 1

    def _pose(self, index: int, now_ns: int) -> MotionCapturePose:
        mock_up, settings = self._mock_ups[index], self._settings
        name = settings.body_name(mock_up.name)
        noise = self._random[index].standard_normal(6).tolist()  # in any case, so that a gap shifts nothing
        is_hidden = self._occlusions[index].is_hidden(now_ns)
        if is_hidden or mock_up.failures.active("hidden_body", now_ns - self._start_ns):
            return MotionCapturePose.untracked(name, self._frames)
        motion = mock_up.vehicle.origin_at(now_ns)
        pivot = turned(about_z(motion.heading_rad), settings.pivot_body_m)
        origin = settings.origin_table_m
        from_origin = (
            motion.x_m + pivot[0] - origin[0],
            motion.y_m + pivot[1] - origin[1],
            pivot[2] - origin[2],
        )
        x, y, z = turned(self._capture_from_table, from_origin)
        dx, dy, dz = (settings.sigma_m * draw for draw in noise[:3])
        # A rigid body's own axes follow the system's when it is defined: up is the same letter in both.
        heading = about_z(motion.heading_rad + math.radians(settings.pivot_yaw_deg))
        turn = times(times(self._capture_from_table, heading), self._up_from_system)
        qx, qy, qz, qw = times(turn, small(*(settings.sigma_rad * draw for draw in noise[3:])))
        return MotionCapturePose(
            name,
            self._frames,
            (_single(x + dx), _single(y + dy), _single(z + dz)),
            (_single(qx), _single(qy), _single(qz), _single(qw)),
            is_tracked=True,
        )


def _single(value: float) -> float:
    """As the wire carries it."""
    return float(np.float32(value))


def _occlusion(mock_up: MockUp, settings: MotionCaptureConfig) -> _Occlusion:
    rng = mock_up.random("motion_capture occlusion")
    wait_s = (
        rng.exponential(1.0 / settings.occlusion_rate_hz) if settings.occlusion_rate_hz > 0.0 else math.inf
    )
    return _Occlusion(
        settings.occlusion_rate_hz, settings.occlusion_s, rng, mock_up.start_ns + wait_s * NS_PER_S
    )


def build(site: Site, settings: MotionCaptureConfig) -> MotionCapture:
    """The system of a laboratory.

    Raises:
        SceneError: `names` fits the vehicles of the scenario badly.
    """
    scenario = site.scenario
    vehicles = [mock_up.name for mock_up in site.mock_ups]
    for vehicle in settings.names:
        if vehicle not in vehicles:
            raise SceneError(f"motion_capture.names: there is no vehicle {vehicle!r}; there are {vehicles}")
    bodies = [settings.body_name(vehicle) for vehicle in vehicles]
    if len(set(bodies)) < len(bodies):
        raise SceneError(f"motion_capture.names: two vehicles bear one rigid body's name: {bodies}")
    return MotionCapture(site.mock_ups, settings, scenario.random("motion_capture"), scenario.start_ns)


DEVICE = DeviceKind(
    name="motion_capture",
    channel=ChannelKind.POSES,
    per_laboratory=build,
    section="motion_capture",
    settings=MotionCaptureConfig,
    served_by="firmware_emulator.live.motion_capture_server:NatNetServed",
    failures={
        "hidden_body": FailureKind("motion_capture", "The motion-capture system does not see the mock-up.")
    },
)
