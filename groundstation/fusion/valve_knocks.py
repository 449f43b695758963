"""How a switching valve is told from noise: it knocks, which the accelerometers read and nothing moves by."""

from __future__ import annotations

import math

from groundstation.fusion.noise import NoiseModel

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
