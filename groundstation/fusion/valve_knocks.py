"""What switching valves add to the noise: a knock that the accelerometers read and nothing moves by."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from groundstation.fusion.error_state import PX, PY, VX, VY
from groundstation.fusion.flight import Flight
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.packet_history import Segment

Array = NDArray[np.float64]

STEP_SIGMAS = 8.0
"""A force that changes by more from packet to packet is a valve, not noise."""
WINDOW_S = 0.01
"""Shorter packets are looked at in groups as long: a valve takes some ms to open."""


def group_of(noise: NoiseModel) -> int:
    """Return how many packets are looked at together."""
    return max(1, round(WINDOW_S / noise.packet_period_s))


def step_of(noise: NoiseModel) -> float:
    """Return the change of the mean force of a group, m/s^2, that only a valve makes."""
    return STEP_SIGMAS * noise.acc_density_m_s2_rthz / math.sqrt(group_of(noise) * noise.packet_period_s)


def add_knocks(Q: Array, segment: Segment, flight: Flight, noise: NoiseModel) -> None:
    """Add to the process covariance Q (5, 5), in place, one knock wherever the force changes abruptly."""
    group = group_of(noise)
    count = len(segment.span_s) // group
    if count < 2:
        return
    force, until_end_s = flight.force_body, flight.until_end_s
    if group > 1:
        force = force[:, : count * group].reshape(2, count, group).mean(axis=2)
        until_end_s = until_end_s[: count * group : group]
    left = until_end_s[1:][(np.abs(force[:, 1:] - force[:, :-1]) > step_of(noise)).any(axis=0)]
    knock = noise.valve_knock_m_s**2
    vv, vp, pp = knock * len(left), knock * float(left.sum()), knock * float(left @ left)
    for v, p in ((VX, PX), (VY, PY)):
        Q[v, v] += vv
        Q[v, p] += vp
        Q[p, v] += vp
        Q[p, p] += pp
