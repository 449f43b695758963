"""State of a rigid body in the plane, and what its IMU feels."""

import math
from typing import NamedTuple

Felt = tuple[float, float, float]
"""What the IMU feels at one poll: rate in rad/s, specific force at its place along body x and y in m/s^2."""

_MAKE = tuple.__new__  # a third of the time of calling a named tuple


class Motion(NamedTuple):
    """Centre of mass and heading in the table frame at one moment.

    Heading counts counter-clockwise from table +x to body +x and is not wrapped.
    """

    x_m: float
    y_m: float
    heading_rad: float
    vx_m_s: float
    vy_m_s: float
    rate_rad_s: float

    def of_point(self, point_body_m: tuple[float, float]) -> "Motion":
        """Motion of a point given in body axes from the centre of mass."""
        cosine, sine = math.cos(self.heading_rad), math.sin(self.heading_rad)
        dx = cosine * point_body_m[0] - sine * point_body_m[1]
        dy = sine * point_body_m[0] + cosine * point_body_m[1]
        return _MAKE(
            Motion,
            (
                self.x_m + dx,
                self.y_m + dy,
                self.heading_rad,
                self.vx_m_s - self.rate_rad_s * dy,
                self.vy_m_s + self.rate_rad_s * dx,
                self.rate_rad_s,
            ),
        )


class PollGrid:
    """Moments at which a microcontroller polls its sensors: its crystal's kHz, not the host's.

    Poll k (from 1) is at `start_ns + k * period_ns`, rounded to ns.
    """

    def __init__(self, start_ns: int, clock_ppm: float) -> None:
        self._start_ns = start_ns
        self.period_ns = NOMINAL_PERIOD_NS / (1.0 + clock_ppm * 1e-6)

    def stamp_ns(self, poll: int) -> int:
        """Moment of poll number `poll`."""
        return self._start_ns + round(poll * self.period_ns)

    def last_poll(self, stamp_ns: int) -> int:
        """Number of the last poll at or before `stamp_ns`; 0 before the first."""
        poll = round((stamp_ns - self._start_ns) / self.period_ns)
        return max(0, poll if self.stamp_ns(poll) <= stamp_ns else poll - 1)


NOMINAL_PERIOD_NS = 1e6  # Timer2 of the PIC16F876A: 20 MHz / 4 / (250 x 4 x 5) = 1000 Hz exactly
