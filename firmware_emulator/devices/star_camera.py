"""The webcam that looks up: when it exposes, where the vehicle is meanwhile, when the picture arrives.

What the picture shows is the business of `firmware_emulator.sky`, behind a `Renderer`; so pictures may be
drawn at once (lockstep) or by another process (live).
"""

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from drivers.laboratory import ChannelKind
from firmware_emulator.device_kind import DeviceKind, PictureOrder
from firmware_emulator.devices.camera_settings import CameraConfig
from firmware_emulator.devices.pending import take_until
from firmware_emulator.devices.repeated_pictures import RepeatedPictures
from firmware_emulator.failures import Failures
from firmware_emulator.plant.motion_state import Motion
from firmware_emulator.plant.rigid_body import Vehicle
from firmware_emulator.plant.thrusters import NS_PER_S
from firmware_emulator.scenario import MockUp, Scenario
from firmware_emulator.sky.sky import SkyFailures

Pose = tuple[float, float, float]
"""x, y (m) and heading (rad) of the body origin in the table frame."""
_JITTER_LIMIT = 6.0  # standard deviations


@dataclass(frozen=True, slots=True)
class Exposure:
    """One picture to be drawn.

    Attributes:
        sequence: Counts the exposures from 0.
        start: Pose when the shutter opened (of the first row, with a rolling shutter).
        end: Pose when it closed (of the last row).
        middle_ns: Middle of the exposure.
        arrival_ns: When the picture reaches the host.
        is_sky_dead: The lights are off.
        false_lights: Lights to add that no catalogue knows.
        sky_failures: LEDs that differ from the list; None if all hang and shine as listed.
        noise: Number that decides the picture's noise; an older one where the camera repeats a picture.
        lower: What the lower half shows, of a torn picture.
    """

    sequence: int
    start: Pose
    end: Pose
    middle_ns: int
    arrival_ns: int
    is_sky_dead: bool
    false_lights: int
    sky_failures: SkyFailures | None = None
    noise: int = 0
    lower: "Exposure | None" = None


class StarCamera:
    """Timing and place of one camera's exposures.

    Args:
        vehicle: That carries it.
        rate_hz: Pictures per second.
        exposure_s: How long a row is exposed.
        readout_s: From the first row's exposure to the last one's.
        delay_s: From the middle of the exposure until the picture is at the host.
        delay_jitter_s: Its standard deviation.
        failures: Those of a camera and of the sky.
        rng: For the jitter.
        start_ns: First exposure begins one period later.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        rate_hz: float,
        exposure_s: float,
        readout_s: float,
        delay_s: float,
        delay_jitter_s: float,
        failures: Failures,
        rng: np.random.Generator,
        start_ns: int,
    ) -> None:
        self._vehicle = vehicle
        self._period_ns = round(NS_PER_S / rate_hz)
        self._open_ns = round((exposure_s + readout_s) * NS_PER_S)
        self._delay_ns = round(delay_s * NS_PER_S)
        self._jitter_ns = delay_jitter_s * NS_PER_S
        self._failures, self._rng, self._start_ns = failures, rng, start_ns
        self._opens_ns = start_ns + self._period_ns
        self._start: Motion | None = None
        self._repeated: RepeatedPictures[Exposure] = RepeatedPictures(failures)
        self._before: Exposure | None = None
        self._sequence = 0
        self._last_arrival_ns = 0
        self._pending: deque[tuple[int, Exposure]] = deque()

    @property
    def next_ns(self) -> int:
        """When the shutter next moves."""
        return self._opens_ns if self._start is None else self._opens_ns + self._open_ns

    @property
    def next_output_ns(self) -> int:
        """When the next picture may reach the host."""
        if self._pending:
            return self._pending[0][0]
        middle_ns = self._opens_ns + self._open_ns // 2
        early_ns = middle_ns + self._delay_ns - round(_JITTER_LIMIT * self._jitter_ns)
        return max(self._opens_ns + self._open_ns, early_ns)

    def run(self, now_ns: int) -> None:
        """Open or close the shutter."""
        if self._start is None:
            self._start = self._vehicle.origin_at(now_ns)
            return
        start, end = self._start, self._vehicle.origin_at(now_ns)
        self._start = None
        middle_ns = self._opens_ns + self._open_ns // 2
        self._opens_ns += self._period_ns
        age_ns = middle_ns - self._start_ns
        jitter = float(np.clip(self._rng.standard_normal(), -_JITTER_LIMIT, _JITTER_LIMIT))
        slow = self._failures.active("slow_camera", age_ns)
        late_ns = self._delay_ns + (round(slow.parameters["delay_s"] * NS_PER_S) if slow else 0)
        arrival_ns = max(now_ns, middle_ns + late_ns + round(jitter * self._jitter_ns))
        self._last_arrival_ns = max(self._last_arrival_ns + 1, arrival_ns)
        is_skipped = slow is not None and self._sequence % int(slow.parameters["keep_one_in"]) != 0
        exposure = self._exposed(_pose(start), _pose(end), middle_ns, age_ns)
        self._sequence += 1
        if not (is_skipped or self._failures.active("silent_camera", age_ns)):
            self._pending.append((exposure.arrival_ns, exposure))

    def _exposed(self, start: Pose, end: Pose, middle_ns: int, age_ns: int) -> Exposure:
        """What is sent of the exposure between two poses."""
        for wrong in self._failures.all_active("wrong_fixes", age_ns):
            start, end = displaced(start, wrong.parameters), displaced(end, wrong.parameters)
        false_lights = self._failures.active("false_lights", age_ns)
        seen = Exposure(
            self._sequence,
            start,
            end,
            middle_ns,
            self._last_arrival_ns,
            self._failures.active("dead_sky", age_ns) is not None,
            int(false_lights.parameters["count"]) if false_lights else 0,
            self._sky_failures(age_ns),
            noise=self._sequence,
        )
        is_torn = self._failures.active("torn_camera", age_ns) is not None
        before, self._before = self._before, seen
        shown = self._repeated.shown(replace(seen, lower=before) if is_torn else seen, age_ns)
        return replace(shown, sequence=seen.sequence, middle_ns=seen.middle_ns, arrival_ns=seen.arrival_ns)

    def _sky_failures(self, age_ns: int) -> SkyFailures | None:
        dead, moved, new = (
            [failure.parameters for failure in self._failures.all_active(kind, age_ns)]
            for kind in ("dead_star", "moved_star", "new_star")
        )
        if not (dead or moved or new):
            return None
        return SkyFailures(
            tuple(int(row["star"]) for row in dead),
            tuple((int(row["star"]), row["dx_m"], row["dy_m"]) for row in moved),
            tuple((row["x_m"], row["y_m"]) for row in new),
        )

    def take(self, until_ns: int) -> list[tuple[int, Exposure]]:
        """Exposures whose pictures reached the host up to `until_ns`."""
        return take_until(self._pending, until_ns)

    def take_exposed(self) -> list[Exposure]:
        """Exposures taken so far, ahead of their arrival: for one who draws them elsewhere."""
        taken = [exposure for _, exposure in self._pending]
        self._pending.clear()
        return taken


def _pose(motion: Motion) -> Pose:
    return motion.x_m, motion.y_m, motion.heading_rad


def displaced(pose: Pose, by: Mapping[str, float]) -> Pose:
    """A camera there sees what one here sees of a sky that was moved the other way."""
    return pose[0] + by["dx_m"], pose[1] + by["dy_m"], pose[2] + math.radians(by["dheading_deg"])


def build(mock_up: MockUp, settings: CameraConfig) -> StarCamera | None:
    """The camera of a mock-up, if it takes pictures."""
    if settings.source != "rendered":
        return None
    return StarCamera(
        mock_up.vehicle,
        settings.rate_hz,
        settings.exposure_s,
        settings.readout_s,
        settings.delay_s,
        settings.delay_jitter_s,
        mock_up.failures,
        mock_up.random("camera"),
        mock_up.start_ns,
    )


def order(scenario: Scenario, index: int, settings: CameraConfig) -> PictureOrder | None:
    """Who draws the pictures of vehicle `index`: all cameras look at one sky, each with noise of its own."""
    if settings.source != "rendered":
        return None
    vehicle = scenario.config.vehicles[index]
    return PictureOrder(
        name=vehicle.name,
        renderer="firmware_emulator.devices.sky_renderer:SkyRenderer",
        arguments={
            "ceiling": scenario.config.path(settings.ceiling),
            "camera": scenario.config.path(settings.camera),
            "exposure_s": settings.exposure_s,
            "readout_s": settings.readout_s,
            "sky_seed": scenario.seed_words,
            "camera_seed": [*scenario.seed_words, 1 + index, vehicle.seed_offset],
        },
        stream=settings.stream,
        jpeg_quality=settings.jpeg_quality,
    )


STAR_CAMERA = DeviceKind(
    name="star_camera",
    channel=ChannelKind.CAMERA,
    per_vehicle=build,
    section="camera",
    settings=CameraConfig,
    is_standard=True,
    pictures=order,
)
