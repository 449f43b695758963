# ruff: noqa: N806 - F, P, Q, H as in the literature
"""The smoother against an independent solution, against truth, and its honesty."""

import math

import numpy as np
import pytest

from groundstation.data_sets.fusion_folder import read_folder
from groundstation.fusion import error_state as es
from groundstation.fusion.flight_data import estimate
from groundstation.fusion.offline import OfflineSmoother
from groundstation.fusion.trace import Carried, Chain, Corrected
from groundstation.fusion.walk_back import smooth_chain


def test_the_backward_walk_is_the_least_squares_solution_of_the_whole_chain():
    """A small linear chain, embedded in the 22 states, against one dense weighted least squares."""
    rng = np.random.default_rng(0)
    live = 3
    steps, x, P = [], np.zeros(es.SIZE), np.zeros((es.SIZE, es.SIZE))
    P[:live, :live] = np.diag([1.0, 2.0, 3.0])
    x0, P0 = x.copy(), P.copy()
    rows, values, weights = [], [], []
    n = 6
    for k in range(n):
        F = np.eye(es.SIZE)
        F[0, 1] = 0.3
        F[1, 2] = 0.2
        Q = np.zeros_like(P)
        Q[:live, :live] = np.diag([0.1, 0.2, 0.05])
        x, P = F @ x, F @ P @ F.T + Q
        steps.append(Carried(float(k + 1), F[: es.MOVING], x.copy(), P.copy(), False))
        H = np.zeros((1, es.SIZE))
        H[0, :live] = rng.normal(0.0, 1.0, live)
        y, R = rng.normal(), 0.3
        S = H @ P @ H.T + R
        K = P @ H.T / S
        z = np.array([y]) - H @ x
        steps.append(Corrected(H, K, np.linalg.inv(S), z))
        x, P = x + K @ z, P - K @ S @ K.T
        # the same as equations: x_{k+1} - F x_k = 0 weighted by Q, H x_{k+1} = y weighted by R
        row = np.zeros((live, live * (n + 1)))
        row[:, k * live : (k + 1) * live] = -F[:live, :live]
        row[:, (k + 1) * live : (k + 2) * live] = np.eye(live)
        rows.append(row)
        values += [0.0] * live
        weights += [1 / 0.1, 1 / 0.2, 1 / 0.05]
        row = np.zeros((1, live * (n + 1)))
        row[:, (k + 1) * live : (k + 2) * live] = H[:, :live]
        rows.append(row)
        values.append(y)
        weights.append(1 / R)
    prior = np.zeros((live, live * (n + 1)))
    prior[:, :live] = np.eye(live)
    A = np.vstack([prior, *rows])
    W = np.diag([1.0, 1 / 2.0, 1 / 3.0, *weights])
    b = np.array([0.0] * live + values)
    information = A.T @ W @ A
    want = np.linalg.solve(information, A.T @ W @ b).reshape(n + 1, live)
    want_P = np.linalg.inv(information)
    nodes = smooth_chain(Chain(0.0, x0, P0, False, steps))
    for k, node in enumerate(nodes):
        np.testing.assert_allclose(node.x[:live], want[k], atol=1e-10)
        block = slice(k * live, (k + 1) * live)
        np.testing.assert_allclose(node.P[:live, :live], want_P[block, block], atol=1e-10)


@pytest.mark.parametrize("scenario", ["station", "spin"])
def test_smoothing_halves_the_causal_error(make_folder, scenario):
    folder = make_folder(scenario=scenario, seed=21, duration_s=40.0)
    data = read_folder(folder)
    smoother = OfflineSmoother(data.noise)
    causal, _ = estimate(data, smoother)
    smoothed = smoother.states()
    truth = np.genfromtxt(folder / "truth.csv", delimiter=",", names=True)
    t = data.imu[:, 0]
    rows = (t > 20.0) & (t < 38.0)
    want = np.column_stack([np.interp(t[rows], truth["t_s"], truth[k]) for k in ("x_m", "y_m")])
    error = {}
    for name, states in (("causal", causal), ("smoothed", smoothed)):
        got = np.array([s[1:3] for s, keep in zip(states, rows, strict=True) if keep])
        error[name] = float(np.sqrt(np.mean(np.sum((got - want) ** 2, axis=1))))
    assert error["smoothed"] < 0.5 * error["causal"]
    assert error["smoothed"] < 1e-3


def test_a_smoothed_trajectory_is_continuous(make_folder):
    data = read_folder(make_folder(scenario="spin", seed=21, duration_s=40.0))
    smoother = OfflineSmoother(data.noise)
    estimate(data, smoother)
    states = np.array([s[1:4] for s in smoother.states() if s is not None])
    steps = np.abs(np.diff(states, axis=0))
    assert steps[:, :2].max() < 0.1 * 0.15
    assert steps[:, 2].max() < math.radians(50.0) * 0.15
    assert len(states) == len(data.imu)
