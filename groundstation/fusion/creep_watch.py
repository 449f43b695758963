"""A gyro whose null creeps, as after switching on, betrays itself by headings that are off to one side."""

from __future__ import annotations

import math

SHARE = 0.25
"""Of a new innovation in the running mean: a memory of some seven fixes."""
THRESHOLD = 1.35
"""3.6 sigmas of the running mean of honest innovations, whose sigma is sqrt(SHARE / (2 - SHARE))."""
BOLDNESS = 1.0
"""Times the implied error of the null, squared, that is added to its variance at each fix."""


class CreepWatch:
    """Watches the sign of heading innovations.

    The filter's random walk of the null is that of a warm sensor. Where the null creeps faster, innovations
    lean to one side long before they leave the gate; then its variance is opened until they stand upright.
    """

    __slots__ = ("_lean",)

    def __init__(self) -> None:
        self._lean = 0.0

    def variance_to_add(self, innovation_rad: float, variance_rad2: float, interval_s: float) -> float:
        """Return what to add to the variance of the gyro's null, (rad/s)^2; zero as long as all is well.

        Args:
            innovation_rad: of the heading.
            variance_rad2: expected of it.
            interval_s: since the last used exposure.
        """
        sigma = math.sqrt(variance_rad2)
        bounded = max(-4.0, min(4.0, innovation_rad / sigma))
        self._lean += SHARE * (bounded - self._lean)
        if abs(self._lean) < THRESHOLD:
            return 0.0
        return BOLDNESS * (self._lean * sigma / max(interval_s, 0.3)) ** 2

    def forget(self) -> None:
        """Begin anew, after a restart."""
        self._lean = 0.0
