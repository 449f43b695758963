"""What ails an IMU block: what deflects its codes beside motion (self-tests, failures), and its firmware."""

import math
from collections.abc import Mapping

from drivers.imu_block.protocol import SelfTestChannel
from firmware_emulator.devices.imu_sensors import (
    GYRO_COUNTS_PER_RAD_S,
    GYRO_NULL,
    TILT_COUNTS_PER_M_S2,
    Disturbances,
)
from firmware_emulator.failures import Failures
from firmware_emulator.plant.air_table import GRAVITY_M_S2

OUT_OF_WINDOW_CODE = 2047.0  # SCA103T: parity or connection failure forces the output to a rail
GYRO_SELF_TEST_COUNTS = 221.0  # ADIS16100: 270 mV over 1.2207 mV
TILT_SELF_TEST_CODE = 1900.0  # SCA103T: "near full scale"
_TILT_TESTS = (
    SelfTestChannel.TILT_X_X,
    SelfTestChannel.TILT_X_Y,
    SelfTestChannel.TILT_Y_X,
    SelfTestChannel.TILT_Y_Y,
)


class Ailments:
    """Self-test and failures of one block.

    Args:
        failures: `stuck_gyro`, `dead_tilt`, `shifted_imu`, `silent_imu`, `clock_jump`, `other_imu`.

    Attributes:
        held_gyro_code: The last code of the gyro, which a stuck one repeats.
    """

    def __init__(self, failures: Failures) -> None:
        self._failures = failures
        self._channels, self._last_poll = SelfTestChannel(0), 0
        self.held_gyro_code = round(GYRO_NULL)

    @property
    def is_testing(self) -> bool:
        """Whether a self-test runs."""
        return bool(self._channels)

    def test(self, channels: SelfTestChannel, last_poll: int) -> None:
        """Deflect channels up to a poll; no channels end a running test."""
        self._channels, self._last_poll = channels, last_poll

    def at(self, age_ns: int, window_end: int) -> Disturbances | None:
        """What disturbs the window that ends with poll `window_end`, `age_ns` after power-up."""
        if not (self._channels or self._failures.has("stuck_gyro", "dead_tilt", "shifted_imu")):
            return None
        if window_end > self._last_poll:
            self._channels = SelfTestChannel(0)
        disturbances = Disturbances()
        if self._channels & SelfTestChannel.GYRO_POSITIVE:
            disturbances.gyro_add_counts += GYRO_SELF_TEST_COUNTS
        if self._channels & SelfTestChannel.GYRO_NEGATIVE:
            disturbances.gyro_add_counts -= GYRO_SELF_TEST_COUNTS
        for channel, bit in enumerate(_TILT_TESTS):
            if self._channels & bit:
                disturbances.forced_tilts[channel] = TILT_SELF_TEST_CODE
        for shift in self._failures.all_active("shifted_imu", age_ns):
            _shift(disturbances, shift.parameters)
        stuck = self._failures.active("stuck_gyro", age_ns)
        if stuck:
            code = stuck.parameters["code"]
            disturbances.gyro_stuck_code = self.held_gyro_code if math.isnan(code) else round(code)
        for dead in self._failures.all_active("dead_tilt", age_ns):
            first = 2 * int(dead.parameters["axis"])
            disturbances.forced_tilts.update({first: OUT_OF_WINDOW_CODE, first + 1: OUT_OF_WINDOW_CODE})
        return disturbances

    def is_silent(self, age_ns: int) -> bool:
        """Whether the block sends nothing."""
        return self._failures.active("silent_imu", age_ns) is not None

    def jumped_ms(self, age_ns: int) -> int:
        """By how much the count of ticks is off."""
        return sum(int(row.parameters["jump_ms"]) for row in self._failures.all_active("clock_jump", age_ns))

    def serial_number(self, own: int, age_ns: int) -> int:
        """What the block reports as its serial number."""
        other = self._failures.active("other_imu", age_ns)
        return own if other is None else int(other.parameters["serial_number"])


def _shift(disturbances: Disturbances, shift: Mapping[str, float]) -> None:
    disturbances.gyro_add_counts += math.radians(shift["gyro_deg_s"]) * GYRO_COUNTS_PER_RAD_S
    x_counts, y_counts = disturbances.tilt_add_counts
    counts_per_mg = 1e-3 * GRAVITY_M_S2 * TILT_COUNTS_PER_M_S2
    disturbances.tilt_add_counts = (
        x_counts + shift["acc_x_mg"] * counts_per_mg,
        y_counts + shift["acc_y_mg"] * counts_per_mg,
    )
