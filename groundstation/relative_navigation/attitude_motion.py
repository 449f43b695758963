"""How bodies turn between frames: Euler's equations without torque; with gravity gradient: `motion_bank`.

``J w' + w x J w = 0``: w the absolute rate, in body axes.
Many bodies at once, as a filter's members are; the turn is a Magnus series of fourth order over short steps.
The core does it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.core.library import default_core

Floats = NDArray[np.float64]

STEP_RAD = 0.3
"""A step turns no body farther: its error is then some 1e-5 rad, whatever the inertia."""
MOST_STEPS = 400


@dataclass(frozen=True, slots=True, eq=False)
class Turned:
    """What a span did to m bodies.

    Attributes:
        rates_rad_s: At its end, body axes, (m, 3).
        turns: (m, 3, 3): ``inertial_from_body`` at the end is that of the beginning times this.
        angle_by_rate: Small turn at the end (body axes) by rate at the beginning, (m, 3, 3), s.
        rate_by_rate: (m, 3, 3).
    """

    rates_rad_s: Floats
    turns: Floats
    angle_by_rate: Floats
    rate_by_rate: Floats


def turn_on(rates_rad_s: Floats, inertia_kg_m2: Floats | None, dt_s: float) -> Turned:
    """Return how bodies turn over a span, without torque.

    Args:
        rates_rad_s: Absolute rates in body axes, (m, 3).
        inertia_kg_m2: Principal moments (3,) along the body axes; None: rates stay in the body.
        dt_s: Length of the span.
    """
    core = default_core()
    rates = np.ascontiguousarray(rates_rad_s, dtype=np.float64)
    inertia = None if inertia_kg_m2 is None else np.ascontiguousarray(inertia_kg_m2, dtype=np.float64)
    count = len(rates)
    after, turned, by_angle, by_rate = (np.empty((count, 3, width)) for width in (1, 3, 3, 3))
    given = [core.doubles(each) for each in (rates, inertia)]
    answered = [core.doubles(each) for each in (after, turned, by_angle, by_rate)]
    null = core.ffi.NULL
    core.lib.gs_turn_on(count, *given, dt_s, null, null, 0.0, STEP_RAD, MOST_STEPS, *answered)
    return Turned(after[:, :, 0], turned, by_angle, by_rate)
