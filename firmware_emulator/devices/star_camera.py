"""The webcam that looks up: when it exposes, where the vehicle is meanwhile, when the picture arrives.

What the picture shows is the business of `firmware_emulator.sky`, behind a `Renderer`; so pictures may be
drawn at once (lockstep) or by another process (live).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from drivers.laboratory import ChannelKind
from firmware_emulator.device_kind import DeviceKind, PictureOrder
from firmware_emulator.devices.camera_settings import CameraConfig
from firmware_emulator.devices.repeated_pictures import RepeatedPictures
from firmware_emulator.devices.shutter import Pose, Shutter, pose_of
from firmware_emulator.failures import Failures
from firmware_emulator.plant.rigid_body import Vehicle
from firmware_emulator.plant.thrusters import NS_PER_S
from firmware_emulator.scenario import MockUp, Scenario
from firmware_emulator.sky.sky import SkyFailures


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


class StarCamera(Shutter[Pose, Exposure]):
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
        super().__init__(rate_hz, exposure_s + readout_s, delay_s, delay_jitter_s, rng, start_ns, 1.0)
        self._vehicle, self._failures = vehicle, failures
        self._repeated: RepeatedPictures[Exposure] = RepeatedPictures(failures)
        self._upper: Exposure | None = None

    def _places(self, now_ns: int) -> Pose:
        return pose_of(self._vehicle, now_ns)

    def _held_up_ns(self, age_ns: int) -> int:
        slow = self._failures.active("slow_camera", age_ns)
        return round(slow.parameters["delay_s"] * NS_PER_S) if slow else 0

    def _exposed(self, before: Pose, after: Pose, middle_ns: int, age_ns: int) -> Exposure | None:
        for wrong in self._failures.all_active("wrong_fixes", age_ns):
            before, after = displaced(before, wrong.parameters), displaced(after, wrong.parameters)
        false_lights = self._failures.active("false_lights", age_ns)
        seen = Exposure(
            self._sequence,
            before,
            after,
            middle_ns,
            self._last_arrival_ns,
            self._failures.active("dead_sky", age_ns) is not None,
            int(false_lights.parameters["count"]) if false_lights else 0,
            self._sky_failures(age_ns),
            noise=self._sequence,
        )
        is_torn = self._failures.active("torn_camera", age_ns) is not None
        upper, self._upper = self._upper, seen
        shown = self._repeated.shown(replace(seen, lower=upper) if is_torn else seen, age_ns)
        slow = self._failures.active("slow_camera", age_ns)
        is_skipped = slow is not None and self._sequence % int(slow.parameters["keep_one_in"]) != 0
        if is_skipped or self._failures.active("silent_camera", age_ns):
            return None
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
