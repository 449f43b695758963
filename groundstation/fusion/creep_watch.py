"""A gyro whose null creeps, as after switching on, betrays itself by headings that are off to one side."""

from __future__ import annotations

import math

MEMORY_S = 2.3
"""Of the running mean of innovations: a creep lasts longer, a run of chance among quick fixes does not."""
LARGEST_SHARE = 0.25
"""Of a new innovation in that mean, however rare fixes are: a memory of some seven of them."""
SIGMAS = 3.6
"""Of the running mean of honest innovations; its sigma is sqrt(share / (2 - share))."""
BOLDNESS = 1.0
"""Times the implied error of the null, squared, that is added to its variance at each of some rare fixes."""


class CreepWatch:
    """Watches the sign of heading innovations.

    The filter's random walk of the null is that of a warm sensor. Where the null creeps faster, innovations
    lean to one side long before they leave the gate; then its variance is opened until they stand upright.
    """

    __slots__ = ("_lean", "_variance")

    def __init__(self) -> None:
        self.forget()

    def variance_to_add(self, innovation_rad: float, variance_rad2: float, interval_s: float) -> float:
        """Return what to add to the variance of the gyro's null, (rad/s)^2; zero as long as all is well.

        Args:
            innovation_rad: of the heading.
            variance_rad2: expected of it.
            interval_s: since the last used exposure.
        """
        sigma = math.sqrt(variance_rad2)
        bounded = max(-4.0, min(4.0, innovation_rad / sigma))
        share = min(LARGEST_SHARE, -math.expm1(-max(interval_s, 0.0) / MEMORY_S))
        self._lean += share * (bounded - self._lean)
        self._variance += share * (share - (2.0 - share) * self._variance)
        if abs(self._lean) < SIGMAS * math.sqrt(self._variance):
            return 0.0
        implied = self._lean * sigma / max(interval_s, 0.3)
        return BOLDNESS * implied**2 * share / LARGEST_SHARE

    def forget(self) -> None:
        """Begin anew, after a restart."""
        self._lean = 0.0
        self._variance = LARGEST_SHARE / (2.0 - LARGEST_SHARE)  # of the mean, in units of the innovations'
