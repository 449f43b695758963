# ruff: noqa: N806 - P, H, R as in the literature
"""The steps of a late fix do what their oracle in NumPy does, to rounding."""

import numpy as np
import pytest
from oracles.late_fix import OracleLateFix

from groundstation.core.library import default_core
from groundstation.fusion import error_state as es
from groundstation.fusion.late_fix import LateFix
from groundstation.fusion.learned_surface import MAX_NODES, LearnedSurface

pytestmark = pytest.mark.core

LENGTH_M = 0.2


def made(seed, nodes):
    rng = np.random.default_rng(seed)
    n = es.SIZE + 2 * nodes
    root = rng.normal(0.0, 1.0, (n, n)) * 10.0 ** rng.uniform(-4.0, -1.0, n)[:, None]
    place = rng.uniform(-0.5, 0.5, (nodes, 2))
    return rng, rng.normal(0.0, 0.1, n), root @ root.T, LearnedSurface.through(place, LENGTH_M)


@pytest.fixture
def both(noise):
    return [LateFix(noise), OracleLateFix(noise)]


def assert_close(found, expected):
    scale = float(np.abs(expected).max())
    np.testing.assert_allclose(found, expected, rtol=1e-7, atol=1e-10 * scale)


@pytest.mark.parametrize("nodes", [0, 1, 7, 32])
@pytest.mark.parametrize("seed", range(3))
def test_a_look_at_the_surface(both, nodes, seed):
    rng, x, P, surface = made(seed, nodes)
    places = [rng.uniform(-0.5, 0.5, 2), *surface.nodes_m[:1] + 0.01, np.array([9.0, 9.0])]
    for place in places:
        found, expected = ([*each.look(surface, x.copy(), P.copy(), place)] for each in both)
        assert len(found[0].nodes_m) == len(expected[0].nodes_m)
        assert_close(found[1], expected[1])
        assert_close(found[2], expected[2])
        assert_close(found[3].weights, expected[3].weights)
        if nodes:
            slopes = [each.slope(surface, x, place).copy() for each in both]
            np.testing.assert_allclose(slopes[0], slopes[1], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("nodes", [0, 7])
@pytest.mark.parametrize("gate", [1e9, 0.0])
@pytest.mark.parametrize("seed", range(3))
def test_a_correction(both, nodes, gate, seed):
    rng, x, P, _ = made(seed, nodes)
    z, H, R = rng.normal(0.0, 0.1, 3), rng.normal(0.0, 1.0, (3, es.SIZE)), np.diag([1e-4, 2e-4, 3e-4])
    results = []
    for each in both:
        after_x, after_P = x.copy(), P.copy()
        correction = each.correct(after_x, after_P, z, H, R, gate)
        if gate == 0.0:
            assert after_x.tobytes() == x.tobytes()
            assert after_P.tobytes() == P.tobytes()
            results.append((correction.nis, correction.S))
        else:
            results.append((*correction, after_x, after_P))
    for found, expected in zip(*results, strict=True):
        assert_close(np.asarray(found), np.asarray(expected))


@pytest.mark.parametrize("seed", range(3))
def test_the_sigmas_after_a_fix(both, noise, seed):
    _, x, P, _ = made(seed, 5)
    found, expected = (each.variance_in_time(x, P, noise) for each in both)
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_what_is_not_a_number_is_outside_the_gate(both):
    _, x, P, _ = made(0, 2)
    for each in both:
        after = x.copy()
        nis = each.correct(after, P.copy(), np.full(3, np.nan), np.ones((3, es.SIZE)), np.eye(3), 25.0).nis
        assert not nis <= 25.0
        assert after.tobytes() == x.tobytes()


def test_the_core_has_room_for_all_nodes_of_a_surface():
    assert default_core().lib.MAX_NODES >= MAX_NODES


def test_the_states_stand_in_the_order_of_the_header():
    lib = default_core().lib
    names = (
        *("THETA", "VX", "VY", "PX", "PY", "GYRO_BIAS", "ACC_BIAS_X", "ACC_BIAS_Y", "SLOPE_X", "SLOPE_Y"),
        *("GYRO_SCALE", "LEVER_X", "LEVER_Y", "WAVE_X", "WAVE_Y", "GYRO_TEMPCO", "ACC_TEMPCO_X"),
        *("ACC_TEMPCO_Y", "FIX_DELAY", "SIZE", "MOVING"),
    )
    for name in names:
        assert getattr(lib, name) == getattr(es, name), name
    assert [es.ACC_MATRIX + k for k in range(4)] == [lib.MXX, lib.MXY, lib.MYX, lib.MYY]
