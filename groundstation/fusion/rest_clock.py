"""How long a landed vehicle has rested without a break, by good samples of its IMU alone.

Only such a rest gives zero offsets. A gap, a sample that is not valid, or motion begins it anew.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from groundstation.fusion.noise import NoiseModel

LONGEST_GAP_S = 0.05
"""Between two samples, by the block's ticks."""
LONGEST_SILENCE_NS = 500_000_000
"""Between two samples at their arrival: delivery is less even than the ticks."""
SIGMAS = 8.0
SAMPLE_FLOORS = (math.radians(0.5), 0.02, 0.02)
"""rad/s, m/s^2, m/s^2: less than what steps beside the table and a fan do to one sample is no motion."""
SMOOTHED_FLOORS = (math.radians(0.2), 0.005, 0.005)
"""Likewise of smoothed readings: half a milliradian of tilt."""
SMOOTHED_OVER_S = 0.25
MEAN_OVER_S = 4.0
"""Long against a push, short against a null that warms up."""
LEAD_NS = 250_000_000
"""Motion began up to so long before it is noticed."""
QUIET_S = 1.0
"""After motion: a hand that carries evenly for a moment is no rest."""

LANDING_S = 0.4
"""After the float air was cut: so long bearings may still carry, and friction has to stop what is left."""

Readings = tuple[float, float, float]
"""Rate (rad/s) and specific forces along body x, y (m/s^2), as read."""


class RestChange(NamedTuple):
    """A rest begins or is over."""

    begins: bool
    t_ns: int


class RestClock:
    """Follows the samples of one vehicle.

    Args:
        noise: Of the sensors, and the averaging window.

    Attributes:
        rest_s: Length of the rest that goes on; after take-off, of the one before it.
    """

    __slots__ = ("_arrived_ns", "_began_ns", "_is_landed", "_newest_ns", "_quiet_s", "_still", "rest_s")

    def __init__(self, noise: NoiseModel) -> None:
        self.rest_s = 0.0
        self._still = _Stillness(noise)
        self._is_landed = False
        self._began_ns: int | None = None
        self._newest_ns = self._arrived_ns = 0
        self._quiet_s = 0.0  # still to pass before a rest begins

    def land(self) -> None:
        """Note that the float air is off: a rest begins with the next good sample; after a flight, later."""
        if not self._is_landed:
            self._is_landed, self.rest_s = True, 0.0
            self._still.begin()

    def float_up(self, now_ns: int) -> RestChange | None:
        """Note that the float air is on: the length of the rest stays what it was."""
        self._is_landed, self._quiet_s = False, LANDING_S
        began_ns, self._began_ns = self._began_ns, None
        return None if began_ns is None else RestChange(False, now_ns)

    def sample(
        self, stamp_ns: int, elapsed_s: float, readings: Readings, now_ns: int, *, is_valid: bool
    ) -> RestChange | None:
        """Take every sample, the useless ones too.

        Args:
            stamp_ns: End of its window.
            elapsed_s: Since the sample before, by the block's ticks; 0 if the block started anew.
            readings: Zero offsets not removed.
            now_ns: Its arrival.
            is_valid: Whether it passed every check.
        """
        last_ns, self._newest_ns, self._arrived_ns = self._newest_ns, stamp_ns, now_ns
        if not self._is_landed:
            return None
        if not is_valid:
            return self._break(last_ns)
        if not (0.0 < elapsed_s <= LONGEST_GAP_S and stamp_ns > last_ns) and self._still.is_begun:
            return self._break(last_ns)
        if self._still.moves(readings, elapsed_s):
            self._quiet_s = QUIET_S
            return self._break(stamp_ns - LEAD_NS)
        if self._began_ns is not None:
            self.rest_s += elapsed_s
            return None
        self._quiet_s -= elapsed_s
        if self._quiet_s > 0.0:
            return None
        self._began_ns = stamp_ns
        return RestChange(True, stamp_ns)

    def check(self, now_ns: int) -> RestChange | None:
        """End a rest of which no more samples come."""
        if self._is_landed and now_ns - self._arrived_ns > LONGEST_SILENCE_NS:
            return self._break(self._newest_ns)
        return None

    def _break(self, t_ns: int) -> RestChange | None:
        began_ns, self._began_ns = self._began_ns, None
        self.rest_s = 0.0
        self._still.begin()
        return None if began_ns is None else RestChange(False, max(t_ns, began_ns))


class _Stillness:
    """Compares readings, one by one and smoothed, with their mean since it began."""

    __slots__ = ("_count", "_means", "_sample_limits", "_smoothed", "_smoothed_limits")

    def __init__(self, noise: NoiseModel) -> None:
        densities = (
            noise.gyro_density_rad_s_rthz,
            noise.acc_density_m_s2_rthz,
            noise.acc_density_m_s2_rthz,
        )
        per_sample = SIGMAS / math.sqrt(noise.packet_period_s)
        smoothed = SIGMAS / math.sqrt(2.0 * SMOOTHED_OVER_S)
        self._sample_limits = [max(per_sample * d, f) for d, f in zip(densities, SAMPLE_FLOORS, strict=True)]
        self._smoothed_limits = [
            max(smoothed * d, f) for d, f in zip(densities, SMOOTHED_FLOORS, strict=True)
        ]
        self._means, self._smoothed = [0.0] * 3, [0.0] * 3
        self._count = 0

    @property
    def is_begun(self) -> bool:
        """Whether there was a reading."""
        return self._count > 0

    def begin(self) -> None:
        """Forget the readings so far."""
        self._count = 0

    def moves(self, readings: Readings, elapsed_s: float) -> bool:
        """Take the next readings; true where they are not those of a vehicle that stands still."""
        self._count += 1
        gain = 1.0 / self._count
        mean_gain, smoothed_gain = (max(gain, elapsed_s / over) for over in (MEAN_OVER_S, SMOOTHED_OVER_S))
        widening = math.sqrt(1.0 + 1.0 / (self._count - 1)) if self._count > 1 else math.inf
        for k, value in enumerate(readings):
            self._smoothed[k] += smoothed_gain * (value - self._smoothed[k])
            if not math.isfinite(value) or abs(value - self._means[k]) > widening * self._sample_limits[k]:
                return True
            self._means[k] += mean_gain * (value - self._means[k])
            if abs(self._smoothed[k] - self._means[k]) > self._smoothed_limits[k]:
                return True
        return False
