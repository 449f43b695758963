"""Velocity and disturbance of one axis, from noisy velocity and from what the valves are known to have done.

Knowing the own push, the observer may average the measured velocity over a second without lagging behind
manoeuvres. What remains unexplained is a disturbance: the slope of the table (3 mm/s^2 for 0.3 mrad), a hose,
a valve that pushes off-centre. It integrates the same innovation, so it takes the place of an integral term;
because it is given the wrench that was really delivered, saturation and closed valves do not wind it up.
Both poles of the observer are equal (G. Franklin, J. Powell, M. Workman, Digital Control of Dynamic Systems,
3rd ed. 1998, section 8.2; the disturbance state in 8.5.2).
"""

import math


class DisturbanceObserver:
    """One axis: metres or radians.

    Args:
        bandwidth_rad_s: Both poles; larger follows a changing disturbance sooner and passes more noise.
        limit: Largest disturbance believed, as an acceleration; beyond it something else is wrong.
    """

    def __init__(self, bandwidth_rad_s: float, limit: float) -> None:
        self._bandwidth_rad_s = bandwidth_rad_s
        self._limit = limit
        self._started = False
        self.speed = 0.0
        """Velocity estimate."""
        self.disturbance = 0.0
        """Acceleration that neither the valves nor the known slope explain."""

    def update(
        self, measured_speed: float, own_acceleration: float, dt_s: float, *, learns: bool = True
    ) -> None:
        """Advance by one span.

        Args:
            measured_speed: Velocity at the end of the span.
            own_acceleration: Mean acceleration over the span by everything that is known.
            dt_s: Length of the span.
            learns: What is left unexplained is a disturbance; not while the valves push so hard that it
                is rather their own error.
        """
        if not self._started:
            self._started = True
            self.speed = measured_speed
            return
        pole = math.exp(-self._bandwidth_rad_s * dt_s)
        predicted = self.speed + (own_acceleration + self.disturbance) * dt_s
        innovation = measured_speed - predicted
        self.speed = predicted + (1.0 - pole * pole) * innovation
        if not learns:
            return
        disturbance = self.disturbance + (1.0 - pole) ** 2 / dt_s * innovation
        self.disturbance = min(max(disturbance, -self._limit), self._limit)
