# ruff: noqa: N806 - Q as in the literature

from dataclasses import replace

import numpy as np
import pytest
from oracles.flight import fly
from oracles.valve_knocks import add_knocks

from groundstation.fusion import error_state as es
from groundstation.fusion.packet_history import Segment


def flown(period_s, force_m_s2, noise):
    """A segment of constant packets, and its flight."""
    n = len(force_m_s2)
    t = period_s * np.arange(1, n + 1)
    nothing = np.zeros(n)
    segment = Segment(t, np.full(n, period_s), nothing, force_m_s2, nothing, nothing, nothing, 0.0, t[-1])
    return segment, fly(es.initial_state(noise), segment, 0.0)


def knocks_of(period_s, force_m_s2, noise):
    noise = replace(noise, packet_period_s=period_s)
    Q = np.zeros((es.MOVING, es.MOVING))
    add_knocks(Q, *flown(period_s, force_m_s2, noise), noise)
    return Q


@pytest.mark.parametrize("period_s", [0.001, 0.004, 0.01])
def test_a_pulse_counts_as_two_knocks_or_hardly_more_whatever_the_rate(noise, period_s):
    t = np.arange(0.0, 0.6, period_s)
    pulse = np.where((t >= 0.2 - 1e-9) & (t < 0.3 - 1e-9), 0.02, 0.0)
    Q = knocks_of(period_s, pulse, noise)
    knock = noise.valve_knock_m_s**2
    count = Q[es.VX, es.VX] / knock
    assert 2.0 - 1e-9 < count < 3.1  # one that falls into the middle of a group of packets shows twice
    left = np.array([0.4, 0.3])
    assert Q[es.PX, es.PX] == pytest.approx(knock * (left**2).mean() * count, rel=0.25)
    assert Q[es.VY, es.PY] == pytest.approx(knock * left.mean() * count, rel=0.15)
    assert np.linalg.eigvalsh(Q).min() > -1e-20


def test_noise_alone_is_no_valve(noise):
    rng = np.random.default_rng(4)
    white = noise.acc_density_m_s2_rthz / np.sqrt(0.01) * rng.normal(size=5000)
    assert not knocks_of(0.01, white, noise).any()
