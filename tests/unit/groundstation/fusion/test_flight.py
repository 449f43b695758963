# ruff: noqa: N806 - F, P, Q, H as in the literature

import numpy as np
import pytest
from oracles.flight import fly, moving_noise, transition

from groundstation.fusion import error_state as es
from groundstation.fusion.packet_history import Segment


def a_segment(rng: np.random.Generator, n: int = 67, holes: tuple[int, ...] = ()) -> Segment:
    is_hole = np.zeros(n)
    is_hole[list(holes)] = 1.0
    span = np.full(n, 0.01)
    span[0] = 0.004
    end = np.cumsum(span)
    rate = 0.5 + rng.normal(0.0, 0.1, n)
    force = rng.normal(0.0, 0.05, (2, n))
    return Segment(end, span, rate, force[0], force[1], rng.normal(0.0, 1.0, n), is_hole, 0.0, end[-1])


def a_state(rng: np.random.Generator) -> np.ndarray:
    x = rng.normal(0.0, 0.01, es.SIZE)
    x[es.THETA], x[es.VX], x[es.PX] = 0.7, 0.05, 1.2
    x[es.ACC_MATRIX : es.ACC_MATRIX + 4] *= 0.2
    return x


@pytest.mark.parametrize("state", range(es.SIZE))
def test_the_transition_is_the_derivative_of_the_flight(state):
    rng = np.random.default_rng(state)
    x, segment = a_state(rng), a_segment(rng)
    F = transition(segment, fly(x, segment, 0.0))
    step = np.zeros(es.SIZE)
    step[state] = 1e-6
    slope = (fly(x + step, segment, 0.0).moved - fly(x - step, segment, 0.0).moved) / 2e-6
    # products of small errors (scale times bias) are left out of the transition
    np.testing.assert_allclose(F[:, state], slope, atol=0.02 * np.abs(slope).max() + 1e-9)


def test_a_flight_cut_in_two_arrives_where_the_whole_one_does():
    rng = np.random.default_rng(3)
    x, whole = a_state(rng), a_segment(rng)
    columns = (whole.end_s, whole.span_s, whole.rate_rad_s, whole.ax_m_s2, whole.ay_m_s2, whole.warmth_k)
    first = Segment(*(c[:30] for c in columns), whole.is_hole[:30], 0.0, whole.end_s[29])
    second = Segment(*(c[30:] for c in columns), whole.is_hole[30:], whole.end_s[29], whole.stop_s)
    y = x.copy()
    y[: es.MOVING] = fly(x, first, 0.0).moved
    np.testing.assert_allclose(fly(y, second, 0.0).moved, fly(x, whole, 0.0).moved, atol=1e-12)


def test_gliding_down_a_slope_is_not_felt_but_moves_the_vehicle():
    x = np.zeros(es.SIZE)
    x[es.SLOPE_X] = 3e-3
    n = 100
    zero = np.zeros(n)
    segment = Segment(np.arange(1, n + 1) * 0.01, np.full(n, 0.01), zero, zero, zero, zero, zero, 0.0, 1.0)
    moved = fly(x, segment, 0.0).moved
    assert moved[es.VX] == pytest.approx(3e-3)
    assert moved[es.PX] == pytest.approx(1.5e-3)


def test_white_noise_grows_as_a_random_walk(noise):
    rng = np.random.default_rng(1)
    segment = a_segment(rng)
    flight = fly(a_state(rng), segment, 0.0)
    Q = moving_noise(segment, flight, noise)
    T, qa = flight.duration_s, noise.acc_density_m_s2_rthz**2
    assert Q[es.VX, es.VX] == pytest.approx(qa * T)
    assert Q[es.PY, es.PY] == pytest.approx(qa * T**3 / 3)
    assert (np.linalg.eigvalsh(Q) >= 0.0).all()


def test_a_hole_while_valves_work_is_less_certain_than_a_quiet_one(noise):
    rng = np.random.default_rng(2)
    busy = a_segment(rng, holes=(30,))
    quiet = Segment(
        busy.end_s, busy.span_s, busy.rate_rad_s, busy.ax_m_s2 * 0.01, busy.ay_m_s2 * 0.01, busy.warmth_k,
        busy.is_hole, 0.0, busy.stop_s,
    )  # fmt: skip
    x = np.zeros(es.SIZE)
    loud = moving_noise(busy, fly(x, busy, 0.0), noise)[es.VX, es.VX]
    soft = moving_noise(quiet, fly(x, quiet, 0.0), noise)[es.VX, es.VX]
    assert loud > 10 * soft
