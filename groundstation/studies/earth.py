"""The Earth as a point mass, for the circular orbits of studies."""

from __future__ import annotations

import math

GM_M3_S2 = 3.986004418e14
"""WGS 84."""


def circular_rate_rad_s(radius_m: float) -> float:
    """Return how fast a circular orbit of this radius goes round."""
    return math.sqrt(GM_M3_S2 / radius_m**3)


def circular_radius_m(rate_rad_s: float) -> float:
    """Return the radius of the circular orbit of this rate."""
    return math.cbrt(GM_M3_S2 / rate_rad_s**2)
