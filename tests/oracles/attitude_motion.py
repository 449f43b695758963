"""What ``attitude.c`` does, in NumPy: Euler's equations, with gravity gradient where the orbit is known.

``J w' + w x J w = 3 n^2 e x J e``: w the absolute rate, e the direction away from the Earth, in body axes.
Many bodies at once, as a filter's members are; the turn is a Magnus series of fourth order over short steps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.attitude_motion import MOST_STEPS, STEP_RAD, Turned

Floats = NDArray[np.float64]

_EYE = np.eye(3)


@dataclass(frozen=True, slots=True, eq=False)
class Vertical:
    """The orbital frame as bodies see it at the beginning of a span.

    Attributes:
        up_body: Unit vectors away from the Earth in body axes, (m, 3).
        normal_body: Unit vectors of the orbit's normal in body axes, (m, 3).
        rate_rad_s: Of the orbit.
    """

    up_body: Floats
    normal_body: Floats
    rate_rad_s: float


def turn_on(
    rates_rad_s: Floats, inertia_kg_m2: Floats | None, dt_s: float, vertical: Vertical | None = None
) -> Turned:
    """Return how bodies turn over a span.

    Args:
        rates_rad_s: Absolute rates in body axes, (m, 3).
        inertia_kg_m2: Principal moments (3,) along the body axes; None: rates stay in the body.
        dt_s: Length of the span.
        vertical: For gravity gradient; None: no torque.
    """
    count = len(rates_rad_s)
    fastest = math.sqrt(float(np.einsum("mi,mi->m", rates_rad_s, rates_rad_s).max()))
    steps = max(1, min(MOST_STEPS, math.ceil(fastest * abs(dt_s) / STEP_RAD)))
    h = dt_s / steps
    rates, up, normal = rates_rad_s, None, None
    if vertical is not None:
        up, normal = vertical.up_body, vertical.normal_body
    turned = np.broadcast_to(_EYE, (count, 3, 3))
    angle_by_rate, rate_by_rate = np.zeros((count, 3, 3)), turned
    for _ in range(steps):
        begin = rates
        if inertia_kg_m2 is None:
            slope_begin = slope_end = np.zeros_like(rates)
        else:
            slope_begin = _acceleration(rates, inertia_kg_m2, up, vertical)
            rates, up, normal = _rates_after(rates, inertia_kg_m2, h, up, normal, vertical, slope_begin)
            slope_end = _acceleration(rates, inertia_kg_m2, up, vertical)
        middle = 0.5 * (begin + rates) + 0.125 * h * (slope_begin - slope_end)
        vector = h / 6.0 * (begin + 4.0 * middle + rates)
        if inertia_kg_m2 is not None:
            vector = vector + h * h / 12.0 * _cross(begin, rates)
        step, k = _turn_and_cross(vector)
        back = step.transpose(0, 2, 1)
        if inertia_kg_m2 is None:
            by_rate, ratio = h * (_EYE - 0.5 * k + k @ k / 6.0), turned if steps == 1 else _EYE
        else:
            w = h * _coupling(middle, inertia_kg_m2)
            by_rate = h * (_EYE + 0.5 * (w - k) + (k @ k - k @ w + w @ w) / 6.0)
            ratio = _EYE + w + 0.5 * (w @ w)
        if steps == 1:
            return Turned(rates, step, by_rate, ratio)
        angle_by_rate = back @ angle_by_rate + by_rate @ rate_by_rate
        rate_by_rate = ratio @ rate_by_rate
        turned = turned @ step
    return Turned(rates, turned, angle_by_rate, rate_by_rate)


def _acceleration(rates: Floats, inertia: Floats, up: Floats | None, vertical: Vertical | None) -> Floats:
    torque = _cross(rates * inertia, rates)
    if up is not None and vertical is not None:
        torque = torque + 3.0 * vertical.rate_rad_s**2 * _cross(up, inertia * up)
    found: Floats = torque / inertia
    return found


def _rates_after(
    rates: Floats,
    inertia: Floats,
    h: float,
    up: Floats | None,
    normal: Floats | None,
    vertical: Vertical | None,
    first: Floats,
) -> tuple[Floats, Floats | None, Floats | None]:
    """One step of Runge and Kutta of the rates, and of the vertical in body axes."""
    if up is None or normal is None or vertical is None:
        second = _acceleration(rates + 0.5 * h * first, inertia, None, None)
        third = _acceleration(rates + 0.5 * h * second, inertia, None, None)
        fourth = _acceleration(rates + h * third, inertia, None, None)
        return rates + h / 6.0 * (first + 2.0 * (second + third) + fourth), None, None
    n = vertical.rate_rad_s

    def slopes(state: Floats) -> Floats:
        w, e, z = state
        return np.stack(
            (_acceleration(w, inertia, e, vertical), n * _cross(z, e) - _cross(w, e), -_cross(w, z))
        )

    state = np.stack((rates, up, normal))
    k1 = slopes(state)
    k2 = slopes(state + 0.5 * h * k1)
    k3 = slopes(state + 0.5 * h * k2)
    k4 = slopes(state + h * k3)
    state = state + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
    return state[0], state[1], state[2]


def _coupling(rates: Floats, inertia: Floats) -> Floats:
    """Derivative (m, 3, 3) of the angular acceleration by the rate, without torque."""
    a, b, c = inertia.tolist()
    p, q, r = (b - c) / a, (c - a) / b, (a - b) / c
    found = np.zeros((len(rates), 3, 3))
    x, y, z = rates.T
    found[:, 0, 1], found[:, 0, 2] = p * z, p * y
    found[:, 1, 0], found[:, 1, 2] = q * z, q * x
    found[:, 2, 0], found[:, 2, 1] = r * y, r * x
    return found


def _cross(a: Floats, b: Floats) -> Floats:
    """Cross products of rows; NumPy's own takes ten times as long for a few rows."""
    found = np.empty_like(a)
    found[:, 0] = a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1]
    found[:, 1] = a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2]
    found[:, 2] = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return found


def _turn_and_cross(vectors: Floats) -> tuple[Floats, Floats]:
    """Rotations and cross matrices (m, 3, 3) of rotation vectors (m, 3)."""
    k = np.zeros((len(vectors), 3, 3))
    k[:, 2, 1], k[:, 0, 2], k[:, 1, 0] = vectors.T
    k[:, 1, 2], k[:, 2, 0], k[:, 0, 1] = -vectors.T
    square = np.maximum(np.einsum("mi,mi->m", vectors, vectors), 1e-24)
    angle = np.sqrt(square)
    a, b = np.sin(angle) / angle, 2.0 * np.square(np.sin(0.5 * angle)) / square
    return _EYE + a[:, None, None] * k + b[:, None, None] * (k @ k), k
