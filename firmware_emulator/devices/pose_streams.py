"""Poses on a wire: the truth as a motion-capture system would send it, and fixes drawn from truth plus noise.

Both speak the reference stream (`docs/interfaces/reference_stream.md`). The truth is stamped exactly; a
drawn fix states the delay that the rig believes in, while the real one scatters.
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
from firmware_emulator.failures import Failures
from firmware_emulator.mock_up_config import VehicleConfig
from firmware_emulator.plant.rigid_body import Vehicle
from firmware_emulator.plant.thrusters import NS_PER_S
from firmware_emulator.scenario import MockUp

_SEQUENCE_MODULUS = 1 << 16
_TRUE_UNCERTAINTY = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class TruthStream:
    """Poses and velocities of a vehicle's body origin at a fixed rate.

    Args:
        index: Vehicle's index.
        vehicle: Whose motion.
        rate_hz: Poses per second.
        delay_s: From the moment of a pose to the host.
        start_ns: First pose one period later.
    """

    def __init__(self, index: int, vehicle: Vehicle, rate_hz: float, delay_s: float, start_ns: int) -> None:
        self._index, self._vehicle = index, vehicle
        self._period_ns = round(NS_PER_S / rate_hz)
        self._delay_ns = round(delay_s * NS_PER_S)
        self.next_ns = start_ns + self._period_ns
        self._sequence = 0
        self._pending: deque[tuple[int, bytes]] = deque()

    @property
    def next_output_ns(self) -> int:
        """When the next pose may reach the host."""
        return self._pending[0][0] if self._pending else self.next_ns + self._delay_ns

    def take(self, until_ns: int) -> list[tuple[int, bytes]]:
        """Poses that reached the host up to `until_ns`."""
        return take_until(self._pending, until_ns)

    def run(self, now_ns: int) -> None:
        """Measure the pose that is due."""
        motion = self._vehicle.origin_at(now_ns)
        pose = ReferencePose(
            vehicle=self._index,
            sequence=self._sequence,
            stamp_source_ns=now_ns,
            age_ns=self._delay_ns,
            position_table_m=(motion.x_m, motion.y_m),
            heading_rad=math.remainder(motion.heading_rad, math.tau),
            velocity_table_m_s=(motion.vx_m_s, motion.vy_m_s),
            rate_rad_s=motion.rate_rad_s,
            pose_covariance=_TRUE_UNCERTAINTY,
            is_host_clock=True,
        )
        self._sequence = (self._sequence + 1) % _SEQUENCE_MODULUS
        self._pending.append((now_ns + self._delay_ns, encode(pose)))
        self.next_ns += self._period_ns


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
        failures: Camera failures: `dead_sky`, `silent_camera`, `frozen_camera`, `false_lights`.
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
        self._frozen: tuple[float, float, float] | None = None
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
        if self._failures.active("dead_sky", age_ns) or self._failures.active("silent_camera", age_ns):
            return
        if missing < self._errors.missing_fraction:
            return
        motion = self._vehicle.origin_at(now_ns)
        x_m = motion.x_m + self._errors.sigma_xy_m * draws[0]
        y_m = motion.y_m + self._errors.sigma_xy_m * draws[1]
        heading_rad = motion.heading_rad + self._errors.sigma_heading_rad * draws[2]
        if wrong < self._errors.wrong_fraction or self._failures.active("false_lights", age_ns):
            x_m, y_m, heading_rad = self._mistaken(x_m, y_m, heading_rad, bool(gross < _GROSS_SHARE))
        if not self._failures.active("frozen_camera", age_ns):
            self._frozen = None
        elif self._frozen is None:
            self._frozen = (x_m, y_m, heading_rad)
        else:  # the picture is the same, so its noise is
            x_m, y_m, heading_rad = self._frozen
        self._send(now_ns, float(draws[3]), float(x_m), float(y_m), float(heading_rad))

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

    def _send(self, now_ns: int, jitter: float, x_m: float, y_m: float, heading_rad: float) -> None:
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
        late_ns = max(0, self._delay_ns + round(min(6.0, max(-6.0, jitter)) * self._jitter_ns))
        # One cable carries them: a fix never overtakes the one before.
        self._last_arrival_ns = max(self._last_arrival_ns + 1, now_ns + late_ns)
        self._pending.append((self._last_arrival_ns, encode(pose)))


_GROSS_SHARE = 0.5
_SUBTLE_M = (0.03, 0.12)
_SUBTLE_RAD = 0.05


def build_truth(mock_up: MockUp, config: VehicleConfig) -> TruthStream | None:
    """The truth about a mock-up, if its table asks for it."""
    if config.reference_rate_hz == 0.0:
        return None
    return TruthStream(
        mock_up.index, mock_up.vehicle, config.reference_rate_hz, config.reference_delay_s, mock_up.start_ns
    )


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


REFERENCE = DeviceKind(
    name="reference",
    channel=ChannelKind.BYTES,
    per_vehicle=build_truth,
    served_by="firmware_emulator.live.served:TcpServed",
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
