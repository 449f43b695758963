"""Motion of two craft about the Earth's centre and the turn of one of them, integrated together.

Newton's law for both, without linearising: of the relative motion the difference of the two attractions, in a
form that does not cancel at metres beside thousands of kilometres. Euler's equations with the exact gravity
gradient of a point mass. Neglected: oblateness, drag, the two craft's pull on each other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]

GM_M3_S2 = 3.986004418e14


@dataclass(frozen=True, slots=True, eq=False)
class TwoBodies:
    """Courses over n moments, inertial axes.

    Attributes:
        first_m: Place of the first craft, (n, 3).
        first_m_s: Its velocity, (n, 3).
        away_m: The second craft from the first, (n, 3).
        away_m_s: Derivative of that, (n, 3).
        inertial_from_body: Turn of the second craft, n of them.
        rates_body_rad_s: Of it, body axes, (n, 3).
    """

    first_m: Floats
    first_m_s: Floats
    away_m: Floats
    away_m_s: Floats
    inertial_from_body: Rotation
    rates_body_rad_s: Floats

    def orbital_axes(self) -> tuple[Floats, Floats]:
        """Rows up, along-track, normal (n, 3, 3) of the first craft, and how fast they turn (n,), rad/s."""
        return orbital_axes(self.first_m, self.first_m_s)


def orbital_axes(places_m: Floats, velocities_m_s: Floats) -> tuple[Floats, Floats]:
    """Return rows up, along-track, normal (n, 3, 3) of places (n, 3), and how fast they turn (n,)."""
    momentum = np.cross(places_m, velocities_m_s)
    up = places_m / np.linalg.norm(places_m, axis=1, keepdims=True)
    normal = momentum / np.linalg.norm(momentum, axis=1, keepdims=True)
    rate = np.linalg.norm(momentum, axis=1) / np.sum(places_m**2, axis=1)
    return np.stack((up, np.cross(normal, up), normal), axis=1), rate


def place_in_orbit(
    semi_major_axis_m: float, eccentricity: float, true_anomaly_rad: float
) -> tuple[Floats, Floats]:
    """Return place and velocity, each (3,), of an orbit in the plane x, y with its perigee on +x."""
    p = semi_major_axis_m * (1.0 - eccentricity**2)
    c, s = math.cos(true_anomaly_rad), math.sin(true_anomaly_rad)
    radius, pace = p / (1.0 + eccentricity * c), math.sqrt(GM_M3_S2 / p)
    return radius * np.array((c, s, 0.0)), pace * np.array((-s, eccentricity + c, 0.0))


def integrate(
    times_s: Floats,
    first: tuple[Floats, Floats],
    away: tuple[Floats, Floats],
    inertial_from_body: Rotation,
    rate_body_rad_s: Floats,
    inertia_kg_m2: Floats,
) -> TwoBodies:
    """Integrate from the first moment on.

    Args:
        times_s: Ascending, (n,).
        first: Place and velocity of the first craft, inertial axes.
        away: The second craft from the first, and the derivative, inertial axes.
        inertial_from_body: Turn of the second craft.
        rate_body_rad_s: Of it, (3,).
        inertia_kg_m2: Of it, principal, (3,).
    """

    def slope(_t: float, y: Floats) -> Floats:
        place, pace, s, ds, q, w = y[:3], y[3:6], y[6:9], y[9:12], y[12:16], y[16:]
        r2 = float(place @ place)
        pull = GM_M3_S2 / (r2 * math.sqrt(r2))
        # |R + s|^-3 = |R|^-3 (1 + q)^-1.5: the difference to 1 without cancelling
        less = math.expm1(-1.5 * math.log1p(float(s @ (s + 2.0 * place)) / r2))
        other = place + s
        return np.concatenate(
            (
                pace,
                -pull * place,
                ds,
                -pull * (s + less * other),
                _turning(q, w),
                _euler(other, q, w, inertia_kg_m2),
            )
        )

    start = np.concatenate((*first, *away, inertial_from_body.as_quat(), rate_body_rad_s))
    span = (float(times_s[0]), float(times_s[-1]))
    longest = 0.3 / (1e-3 + float(np.linalg.norm(rate_body_rad_s)))
    found = solve_ivp(
        slope, span, start, "DOP853", times_s, rtol=1e-11, atol=1e-12, max_step=max(longest, 1e-3)
    )
    y = found.y.T
    return TwoBodies(y[:, :3], y[:, 3:6], y[:, 6:9], y[:, 9:12], Rotation.from_quat(y[:, 12:16]), y[:, 16:])


def _turning(q: Floats, w: Floats) -> Floats:
    """Derivative of a quaternion, scalar last, by a rate in body axes."""
    vector, scalar = q[:3], q[3]
    return 0.5 * np.append(scalar * w + np.cross(vector, w), -vector @ w)


def _euler(place: Floats, q: Floats, w: Floats, inertia: Floats) -> Floats:
    up = Rotation.from_quat(q).inv().apply(place)
    radius = float(np.linalg.norm(up))
    gradient = 3.0 * GM_M3_S2 / radius**5 * np.cross(up, inertia * up)
    found: Floats = (gradient - np.cross(w, inertia * w)) / inertia
    return found
