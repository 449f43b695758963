# ruff: noqa: N806 - F, P, H, K as in the literature
"""The learned surface against Gaussian process regression done in one piece."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.fusion import error_state as es
from groundstation.fusion import learned_surface
from groundstation.fusion.learned_surface import NUGGET, LearnedSurface, covariance, look
from groundstation.fusion.walk_back import _back

WAVE = slice(es.WAVE_X, es.WAVE_Y + 1)
places = st.lists(st.tuples(st.floats(-1, 1), st.floats(-1, 1)), min_size=1, max_size=12)


def fresh(noise):
    return LearnedSurface.untouched(noise), es.initial_state(noise), np.diag(es.initial_variance(noise))


def measure(x, P, value, sigma):  # noqa: N803
    """A Kalman update by the local slope itself."""
    H = np.zeros((2, len(x)))
    H[0, es.WAVE_X] = H[1, es.WAVE_Y] = 1.0
    S = H @ P @ H.T + sigma**2 * np.eye(2)
    K = P @ H.T @ np.linalg.inv(S)
    return x + K @ (value - x[WAVE]), P - K @ S @ K.T


def test_slopes_covary_as_derivatives_of_the_heights_do():
    p, q, length, h = np.array([0.13, -0.2]), np.array([-0.05, 0.04]), 0.2, 1e-4

    def height(a, b):
        return length**2 * np.exp(-0.5 * ((a - b) ** 2).sum() / length**2)

    got = covariance(p[None], q[None], length)
    for i, j in np.ndindex(2, 2):
        a, b = h * np.eye(2)[i], h * np.eye(2)[j]
        want = (height(p + a, q + b) - height(p + a, q - b) - height(p - a, q + b) + height(p - a, q - b)) / (
            4.0 * h * h
        )
        assert got[i, j] == pytest.approx(want, abs=1e-5)


@given(places)
def test_no_places_make_an_impossible_covariance(chosen):
    p = np.array(chosen)
    assert np.linalg.eigvalsh(covariance(p, p, 0.2)).min() > -1e-9


def test_measured_nodes_predict_a_place_as_one_regression_does(noise):
    rng = np.random.default_rng(3)
    surface, x, P = fresh(noise)
    visited = np.array([[0.0, 0.0], [0.25, 0.02], [0.5, 0.0], [0.52, 0.24], [0.3, 0.3]])
    values = 2e-4 * rng.normal(size=(5, 2))
    sigma = 5e-5
    for place, value in zip(visited, values, strict=True):
        surface, x, P, _ = look(surface, x, P, place, noise)
        x, P = measure(x, P, value, sigma)
    assert len(surface.nodes_m) == 5
    wanted = np.array([0.4, 0.1])
    _, x, P, step = look(surface, x, P, wanted, noise)
    assert step.grown is None
    variance = noise.waviness_sigma_m_s2**2
    K = variance * covariance(visited, visited, noise.waviness_length_m)
    k = variance * covariance(wanted[None], visited, noise.waviness_length_m)
    gain = k @ np.linalg.inv(K + sigma**2 * np.eye(10))
    nugget = 10.0 * NUGGET  # what the diagonal was raised by, felt through the inverse
    np.testing.assert_allclose(x[WAVE], gain @ values.ravel(), atol=nugget * 2e-4)
    np.testing.assert_allclose(P[WAVE, WAVE], variance * np.eye(2) - gain @ k.T, atol=nugget * variance)


def test_an_unseen_place_is_as_unknown_as_before_and_a_seen_one_is_known_on_return(noise):
    surface, x, P = fresh(noise)
    home, away = np.zeros(2), np.array([1.5, 0.0])
    surface, x, P, _ = look(surface, x, P, home, noise)
    x, P = measure(x, P, np.array([2e-4, -1e-4]), 1e-6)
    surface, x, P, _ = look(surface, x, P, away, noise)
    prior = noise.waviness_sigma_m_s2**2 * np.eye(2)
    np.testing.assert_allclose(P[WAVE, WAVE], prior, rtol=1e-6, atol=1e-6 * prior[0, 0])
    np.testing.assert_allclose(x[WAVE], 0.0, atol=1e-12)
    surface, x, P, _ = look(surface, x, P, home, noise)
    np.testing.assert_allclose(x[WAVE], [2e-4, -1e-4], rtol=1e-2)
    assert P[es.WAVE_X, es.WAVE_X] < 0.01 * prior[0, 0]


def test_a_large_table_keeps_the_nearest_nodes_and_a_true_covariance(noise):
    surface, x, P = fresh(noise)
    for k in range(learned_surface.MAX_NODES + 9):
        surface, x, P, _ = look(surface, x, P, np.array([0.3 * k, 0.0]), noise)
        x, P = measure(x, P, np.array([1e-4, 0.0]), 1e-4)
    assert len(surface.nodes_m) == learned_surface.MAX_NODES
    assert len(x) == es.SIZE + 2 * learned_surface.MAX_NODES
    assert surface.nodes_m[:, 0].min() == pytest.approx(0.3 * 9)
    assert np.linalg.eigvalsh(0.5 * (P + P.T)).min() > -1e-15


@settings(max_examples=8, deadline=None)
@given(places, st.integers(1, 4))
def test_the_smoother_walks_each_look_back_by_its_transpose(chosen, most):
    from groundstation.fusion.noise import NoiseModel

    noise = NoiseModel(
        packet_period_s=0.01, gyro_density_rad_s_rthz=6e-5, acc_density_m_s2_rthz=6e-5,
        star_sigma_xy_m=1e-3, star_sigma_heading_rad=9e-4,
    )  # fmt: skip
    surface, x, P = fresh(noise)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(learned_surface, "MAX_NODES", most)
        for place in chosen:
            n = len(x)
            columns = []
            for unit in np.eye(n):
                after, moved, _, step = look(surface, unit.copy(), P.copy(), np.array(place), noise)
                columns.append(moved)
            F = np.column_stack(columns)
            A = np.random.default_rng(n).normal(size=(len(F), 3))
            np.testing.assert_allclose(_back(step, A), F.T @ A, atol=1e-9)
            surface, x, P, _ = look(surface, x, P, np.array(place), noise)
            np.testing.assert_array_equal(after.nodes_m, surface.nodes_m)
