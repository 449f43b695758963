"""Relative motion of two centres of mass near a circular orbit: Hill, Clohessy, Wiltshire.

Axes ``orbital``: x radial up, y along-track, z along the orbit's normal:
``x'' = 2 n y' + 3 n^2 x, y'' = -2 n x', z'' = -n^2 z``. The publication on the Chibis-M calls them z, x, y:
its constants C1 to C6 are `hill_constants`. Assumed: a circular orbit of the first craft, distances small
beside its radius, no forces but a central gravity and, where given, a constant acceleration in these axes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_SMALL = 1e-2
"""Below this angle differences of sine and cosine come from their series."""


def hill_transition(rate_rad_s: float, dt_s: float) -> Floats:
    """Return the matrix (6, 6) that carries position (m) and velocity (m/s) over a time.

    Rate 0 is a straight line.
    """
    n, t = rate_rad_s, dt_s
    a = n * t
    s, c = math.sin(a), math.cos(a)
    sine, versine = _sine_over(n, t), _versine_over(n, t)
    found = np.zeros((6, 6))
    found[0, :] = (4.0 - 3.0 * c, 0.0, 0.0, sine, 2.0 * versine, 0.0)
    found[1, :] = (6.0 * (s - a), 1.0, 0.0, -2.0 * versine, 4.0 * sine - 3.0 * t, 0.0)
    found[2, 2], found[2, 5] = c, sine
    found[3, :] = (3.0 * n * s, 0.0, 0.0, c, 2.0 * s, 0.0)
    found[4, :] = (6.0 * n * (c - 1.0), 0.0, 0.0, -2.0 * s, 4.0 * c - 3.0, 0.0)
    found[5, 2], found[5, 5] = -n * s, c
    return found


def hill_response(rate_rad_s: float, dt_s: float) -> Floats:
    """Return what a constant acceleration (3,) in orbital axes adds to position and velocity, (6, 3)."""
    n, t = rate_rad_s, dt_s
    a = n * t
    if abs(a) < _SMALL:
        half = t * t * (0.5 - a * a / 24.0)
        third = t * t * a * (1.0 / 6.0 - a * a / 120.0)
    else:
        half = (1.0 - math.cos(a)) / n**2
        third = (a - math.sin(a)) / n**2
    sine, versine = _sine_over(n, t), _versine_over(n, t)
    found = np.zeros((6, 3))
    found[0, :2] = half, 2.0 * third
    found[1, :2] = -2.0 * third, 4.0 * half - 1.5 * t * t
    found[2, 2] = half
    found[3, :2] = sine, 2.0 * versine
    found[4, :2] = -2.0 * versine, 4.0 * sine - 3.0 * t
    found[5, 2] = sine
    return found


@dataclass(frozen=True, slots=True)
class HillConstants:
    """The published constants of a relative orbit: their x is along-track, y normal, z radial.

    ``x = C4 - 3 C1 w t + 2 C2 cos wt - 2 C3 sin wt, y = C5 sin wt + C6 cos wt,
    z = 2 C1 + C2 sin wt + C3 cos wt``.
    """

    c1: float
    c2: float
    c3: float
    c4: float
    c5: float
    c6: float
    rate_rad_s: float

    @property
    def drift_m_s(self) -> float:
        """How fast the ellipse wanders along the track."""
        return -3.0 * self.c1 * self.rate_rad_s

    @property
    def drift_m_rev(self) -> float:
        """How far the ellipse wanders along the track in one revolution."""
        return -6.0 * math.pi * self.c1

    @property
    def semi_axes_m(self) -> tuple[float, float, float]:
        """Of the ellipse: radial, along-track (twice as long), and of the swing along the normal."""
        radial = math.hypot(self.c2, self.c3)
        return radial, 2.0 * radial, math.hypot(self.c5, self.c6)

    def centre_m(self, t_s: float) -> tuple[float, float]:
        """Along-track and radial place of the ellipse's centre."""
        return self.c4 + self.drift_m_s * t_s, 2.0 * self.c1

    def is_bounded(self, within_m_rev: float = 1e-3) -> bool:
        """Whether the ellipse stays: C1 = 0, that is along-track velocity -2 w times radial place."""
        return abs(self.drift_m_rev) <= within_m_rev


def hill_constants(position_m: Floats, velocity_m_s: Floats, rate_rad_s: float) -> HillConstants:
    """Return the constants of a state in orbital axes, (3,) and (3,).

    Raises:
        ValueError: The rate is not above zero.
    """
    if not rate_rad_s > 0.0:
        raise ValueError(f"the orbital rate must be above zero, found {rate_rad_s:g} rad/s")
    z, x, y = position_m.tolist()
    vz, vx, vy = velocity_m_s.tolist()
    w = rate_rad_s
    return HillConstants(
        2.0 * z + vx / w, vz / w, -3.0 * z - 2.0 * vx / w, x - 2.0 * vz / w, vy / w, y, rate_rad_s
    )


def _sine_over(n: float, t: float) -> float:
    """``sin(n t) / n``."""
    return t if n == 0.0 else math.sin(n * t) / n


def _versine_over(n: float, t: float) -> float:
    """``(1 - cos(n t)) / n``."""
    return 0.0 if n == 0.0 else 2.0 * math.sin(0.5 * n * t) ** 2 / n
