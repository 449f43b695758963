"""Fixes drawn from truth plus noise, in place of a camera and its star tracker.

They come on the reference stream's wire (`docs/interfaces/reference_stream.md`) and state the delay that the
rig believes in, while the real one scatters.
"""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from drivers.laboratory import ChannelKind
from drivers.reference.protocol import ReferencePose, encode
from firmware_emulator.device_kind import DeviceKind
from firmware_emulator.devices.camera_settings import CameraConfig
from firmware_emulator.devices.pending import take_until
from firmware_emulator.devices.repeated_pictures import RepeatedPictures
from firmware_emulator.devices.shutter import Pose
from firmware_emulator.devices.star_camera import displaced
from firmware_emulator.failures import Failures
from firmware_emulator.plant.rigid_body import Vehicle
from firmware_emulator.plant.thrusters import NS_PER_S
from firmware_emulator.scenario import MockUp

_SEQUENCE_MODULUS = 1 << 16


@dataclass(frozen=True, slots=True)
class FixErrors:
    """How drawn fixes differ from the truth.

    Attributes:
        sigma_xy_m: Standard deviation per axis, also what the fix states of itself.
        sigma_heading_rad: Likewise.
        missing_fraction: Of the pictures, how many give no fix.
        wrong_fraction: Of the fixes, how many are wrong and do not state it so: half anywhere on the table,
            half by some centimetres.
        bounds_m: Where the wildly wrong ones fall: x_min, x_max, y_min, y_max.
    """

    sigma_xy_m: float
    sigma_heading_rad: float
    missing_fraction: float
    wrong_fraction: float
    bounds_m: tuple[float, float, float, float]


class FixStream:
    """Star fixes without stars: late, noisy, sometimes missing, sometimes wrong.

    Args:
        index: Vehicle's index.
        vehicle: Whose motion.
        rate_hz: Exposures per second.
        delay_s: From an exposure to its fix at the host, as the fix states.
        delay_jitter_s: Standard deviation of the real delay.
        errors: What is wrong with the fixes.
        failures: Those of a camera.
        rng: Random numbers.
        start_ns: First exposure one period later.
    """

    def __init__(
        self,
        index: int,
        vehicle: Vehicle,
        rate_hz: float,
        delay_s: float,
        delay_jitter_s: float,
        errors: FixErrors,
        failures: Failures,
        rng: np.random.Generator,
        start_ns: int,
    ) -> None:
        self._index, self._vehicle = index, vehicle
        self._period_ns = round(NS_PER_S / rate_hz)
        self._delay_ns = round(delay_s * NS_PER_S)
        self._jitter_ns = delay_jitter_s * NS_PER_S
        self._errors, self._failures, self._rng = errors, failures, rng
        self._start_ns = start_ns
        self.next_ns = start_ns + self._period_ns
        self._sequence = 0
        self._repeated: RepeatedPictures[Pose] = RepeatedPictures(failures)
        self._before: Pose | None = None
        self._exposures = 0
        self._last_arrival_ns = 0
        self._pending: deque[tuple[int, bytes]] = deque()

    @property
    def next_output_ns(self) -> int:
        """When the next fix may reach the host."""
        if self._pending:
            return self._pending[0][0]
        return max(self.next_ns, self.next_ns + self._delay_ns - round(6.0 * self._jitter_ns))

    def take(self, until_ns: int) -> list[tuple[int, bytes]]:
        """Fixes that reached the host up to `until_ns`."""
        return take_until(self._pending, until_ns)

    def run(self, now_ns: int) -> None:
        """Expose: draw the fix that is due."""
        self.next_ns += self._period_ns
        age_ns = now_ns - self._start_ns
        draws = self._rng.standard_normal(4)  # drawn in any case, so that failures do not shift the rest
        missing, wrong, gross = self._rng.uniform(size=3)
        self._exposures += 1
        if self._failures.active("dead_sky", age_ns) or self._failures.active("silent_camera", age_ns):
            return
        if missing < self._errors.missing_fraction:
            return
        slow = self._failures.active("slow_camera", age_ns)
        if slow and (self._exposures - 1) % int(slow.parameters["keep_one_in"]) != 0:
            return
        motion = self._vehicle.origin_at(now_ns)
        x_m = motion.x_m + self._errors.sigma_xy_m * draws[0]
        y_m = motion.y_m + self._errors.sigma_xy_m * draws[1]
        heading_rad = motion.heading_rad + self._errors.sigma_heading_rad * draws[2]
        if wrong < self._errors.wrong_fraction or self._failures.active("false_lights", age_ns):
            x_m, y_m, heading_rad = self._mistaken(x_m, y_m, heading_rad, bool(gross < _GROSS_SHARE))
        pose = self._sent((float(x_m), float(y_m), float(heading_rad)), age_ns)
        self._send(now_ns, float(draws[3]), slow.parameters["delay_s"] if slow else 0.0, pose)

    def _sent(self, pose: Pose, age_ns: int) -> Pose:
        """What a camera that fails makes of a pose."""
        for row in self._failures.all_active("wrong_fixes", age_ns):
            pose = displaced(pose, row.parameters)
        before, self._before = self._before, pose
        if before is not None and self._failures.active("torn_camera", age_ns):
            turned_rad = math.remainder(before[2] - pose[2], math.tau)
            pose = (0.5 * (pose[0] + before[0]), 0.5 * (pose[1] + before[1]), pose[2] + 0.5 * turned_rad)
        return self._repeated.shown(pose, age_ns)

    def _mistaken(self, x_m: float, y_m: float, heading_rad: float, is_gross: bool) -> tuple[float, ...]:
        if is_gross:
            x_min, x_max, y_min, y_max = self._errors.bounds_m
            return (
                self._rng.uniform(x_min, x_max),
                self._rng.uniform(y_min, y_max),
                self._rng.uniform(-math.pi, math.pi),
            )
        direction_rad = self._rng.uniform(0.0, math.tau)
        distance_m = self._rng.uniform(*_SUBTLE_M)
        turned_rad = self._rng.uniform(-_SUBTLE_RAD, _SUBTLE_RAD)
        return (
            x_m + distance_m * math.cos(direction_rad),
            y_m + distance_m * math.sin(direction_rad),
            heading_rad + turned_rad,
        )

    def _send(self, now_ns: int, jitter: float, more_delay_s: float, sent: Pose) -> None:
        x_m, y_m, heading_rad = sent
        variance_m2, variance_rad2 = self._errors.sigma_xy_m**2, self._errors.sigma_heading_rad**2
        pose = ReferencePose(
            vehicle=self._index,
            sequence=self._sequence,
            stamp_source_ns=now_ns,
            age_ns=self._delay_ns,
            position_table_m=(x_m, y_m),
            heading_rad=math.remainder(heading_rad, math.tau),
            pose_covariance=(variance_m2, 0.0, 0.0, variance_m2, 0.0, variance_rad2),
        )
        self._sequence = (self._sequence + 1) % _SEQUENCE_MODULUS
        real_ns = self._delay_ns + round(more_delay_s * NS_PER_S)
        late_ns = max(0, real_ns + round(min(6.0, max(-6.0, jitter)) * self._jitter_ns))
        # One cable carries them: a fix never overtakes the one before.
        self._last_arrival_ns = max(self._last_arrival_ns + 1, now_ns + late_ns)
        self._pending.append((self._last_arrival_ns, encode(pose)))


_GROSS_SHARE = 0.5
_SUBTLE_M = (0.03, 0.12)
_SUBTLE_RAD = 0.05


def build_fixes(mock_up: MockUp, settings: CameraConfig) -> FixStream | None:
    """The drawn fixes of a mock-up, if they stand in for its camera."""
    if settings.source != "fixes":
        return None
    errors = FixErrors(
        settings.sigma_xy_m,
        settings.sigma_heading_rad,
        settings.missing_fraction,
        settings.wrong_fraction,
        mock_up.scenario.config.table.bounds_m,
    )
    return FixStream(
        mock_up.index,
        mock_up.vehicle,
        settings.rate_hz,
        settings.delay_s,
        settings.delay_jitter_s,
        errors,
        mock_up.failures,
        mock_up.random("camera"),
        mock_up.start_ns,
    )


FIXES = DeviceKind(
    name="fixes",
    channel=ChannelKind.BYTES,
    per_vehicle=build_fixes,
    section="camera",
    settings=CameraConfig,
    is_standard=True,
    served_by="firmware_emulator.live.served:TcpServed",
)
