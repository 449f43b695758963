"""The regular precession of an axisymmetric body, closed form, and the published quantities of it.

Simakov, Ustyugov 2016, formulas (1): with the axis x, ``w_n = sqrt(wy^2 + wz^2)``, ``K = (Ix wx, In w_n)``,
``alpha = asin(K_n / K)`` and ``psi' = Ix wx / (In cos alpha)``. For a negative wx that psi' is negative,
while the body precesses by ``+K/In`` about the vector K: both are given here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.rotations import turn, turns

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class AxialInertia:
    """Moments of an axisymmetric body whose axis is x.

    Raises:
        ValueError: They are of no body.
    """

    along_kg_m2: float
    across_kg_m2: float

    def __post_init__(self) -> None:
        if not (self.along_kg_m2 > 0.0 and self.across_kg_m2 > 0.0):
            raise ValueError("Ix and In must be above zero")
        if self.along_kg_m2 > 2.0 * self.across_kg_m2 * (1.0 + 1e-9):
            raise ValueError(
                f"Ix {self.along_kg_m2:g} is more than twice In {self.across_kg_m2:g}: of no body"
            )


@dataclass(frozen=True, slots=True)
class Precession:
    """Quantities of a regular precession, momentum in kg m^2 rad/s, angles rad, rates rad/s.

    Attributes:
        momentum: K.
        momentum_along: Ix wx.
        momentum_across: In w_n.
        half_angle_rad: Published alpha, 0 to a quarter turn.
        published_rate_rad_s: Published psi', signed as wx.
        rate_rad_s: About the vector K: K/In.
        axis_angle_rad: From K to the body's +x, 0 to half a turn.
    """

    momentum: float
    momentum_along: float
    momentum_across: float
    half_angle_rad: float
    published_rate_rad_s: float
    rate_rad_s: float
    axis_angle_rad: float


def precession_of(rate_body_rad_s: Floats, inertia: AxialInertia) -> Precession:
    """Return the quantities of the motion with a rate (3,) in body axes.

    Raises:
        ValueError: The body does not turn, or turns across its axis only: the published psi' has no value.
    """
    wx, wy, wz = rate_body_rad_s.tolist()
    along, across = inertia.along_kg_m2 * wx, inertia.across_kg_m2 * math.hypot(wy, wz)
    momentum = math.hypot(along, across)
    if momentum == 0.0:
        raise ValueError("the body does not turn: it has no precession")
    alpha = math.asin(min(1.0, across / momentum))
    cosine = math.sqrt(max(0.0, 1.0 - (across / momentum) ** 2))
    published = math.nan if cosine == 0.0 else along / (inertia.across_kg_m2 * cosine)
    return Precession(
        momentum,
        along,
        across,
        alpha,
        published,
        momentum / inertia.across_kg_m2,
        math.atan2(across, along),
    )


def precess(start: Floats, rate_body_rad_s: Floats, inertia: AxialInertia, times_s: Floats) -> Floats:
    """Return rotations at times (n,) from that at time 0, inertial from body.

    ``R(t) = exp([K] t / In) R0 exp([x] (1 - Ix/In) wx t)`` with ``K = R0 diag(Ix, In, In) w``.

    Args:
        start: Of one motion (3, 3), or of many (g, 3, 3).
        rate_body_rad_s: Of each at time 0, (3,) or (g, 3).
        inertia: Of the body.
        times_s: (n,).

    Returns:
        (n, 3, 3) of one motion, (g, n, 3, 3) of many.
    """
    moments = np.array((inertia.along_kg_m2, inertia.across_kg_m2, inertia.across_kg_m2))
    about = (start @ (moments * rate_body_rad_s)[..., None])[..., 0] / inertia.across_kg_m2
    spin = (1.0 - inertia.along_kg_m2 / inertia.across_kg_m2) * rate_body_rad_s[..., 0]
    shape = (*rate_body_rad_s.shape[:-1], len(times_s), 3)
    own = np.zeros(shape)
    own[..., 0] = spin[..., None] * times_s
    swung = times_s[:, None] * about[..., None, :]
    first, last = (turns(each.reshape(-1, 3)).reshape(*shape, 3) for each in (swung, own))
    found: Floats = first @ start[..., None, :, :] @ last
    return found


def rate_after(rate_body_rad_s: Floats, inertia: AxialInertia, t_s: float) -> Floats:
    """Return the rate (3,) in body axes after a time: its part across the axis turns about it."""
    spin = (1.0 - inertia.along_kg_m2 / inertia.across_kg_m2) * float(rate_body_rad_s[0])
    found: Floats = turn(np.array((-spin * t_s, 0.0, 0.0))) @ rate_body_rad_s
    return found
