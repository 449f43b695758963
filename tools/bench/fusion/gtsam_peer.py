"""gtsam's fixed-lag smoother on pre-integrated readings, with fixes that a Cauchy kernel makes robust."""

import importlib
from collections.abc import Callable
from typing import Any

import numpy as np

from bench.fusion.late import LatePeer
from bench.fusion.planar import (
    Array,
    Reading,
    at_rest,
    at_rest_jacobian,
    pose_jacobian,
    pose_of,
    prior_variance,
)
from bench.fusion.preintegration import Stretch
from groundstation.fusion.estimator import Fix
from groundstation.fusion.noise import NoiseModel

LAG_S = 8.0
CAUCHY_SIGMAS = 2.0
BELIEVED = 25.0
"""A fix whose squared residual is below, after the smoothing, counts as believed."""

Foreign = Any
"""Objects of gtsam, which has no types to check."""
UNIT = np.array([1e-3] * 5 + [1e-4] + [1e-3] * 5)
"""Of the nodes' states: mm, mrad and the like, so that the normal equations are well conditioned."""

Model = Callable[[Array], tuple[Array, Array]]


class GtsamPeer(LatePeer):
    """A node per exposure, eight seconds of them re-optimised at every fix.

    Raises:
        ImportError: gtsam is not installed.
    """

    def __init__(self, noise: NoiseModel) -> None:
        super().__init__(noise)
        self._gtsam: Foreign = importlib.import_module("gtsam")
        self._smoother = self._gtsam.BatchFixedLagSmoother(LAG_S)
        self._node = 0
        self._before = self._x
        """At the newest node."""
        self._stretch = Stretch(self._before, noise)
        self._elapsed_s = 0.0

    def _start(self) -> None:
        start, eye = self._x, np.eye(len(self._x))
        graph = self._gtsam.NonlinearFactorGraph()
        graph.add(self._unary(lambda x: (x - start, eye), np.diag(prior_variance(self.noise))))
        self._update(graph, start)

    def _advance(self, reading: Reading) -> None:
        if self.is_at_rest(reading):
            self._stretch.rest(reading)
        else:
            self._stretch.move(reading)
        self._elapsed_s += reading.dt_s
        self._x, _ = self._stretch.predict(self._before)

    def _correct(self, fix: Fix, innovation: Array) -> tuple[bool, float]:
        stretch, before = self._stretch, self._node
        self._node += 1
        graph = self._gtsam.NonlinearFactorGraph()
        graph.add(self._between(before, stretch))
        if stretch.rest_s > 0.0:
            graph.add(self._resting(stretch))
        seen = pose_of(self._x, self.noise) + innovation
        model = self._gtsam.noiseModel
        kernel = model.mEstimator.Cauchy.Create(CAUCHY_SIGMAS)
        robust = model.Robust.Create(kernel, model.Gaussian.Covariance(fix.covariance))
        graph.add(
            self._unary(lambda x: (pose_of(x, self.noise) - seen, pose_jacobian(x, self.noise)), robust)
        )
        nis = float(innovation @ np.linalg.solve(fix.covariance, innovation))
        self._update(graph, self._x)
        residual = pose_of(self._x, self.noise) - seen
        return float(residual @ np.linalg.solve(fix.covariance, residual)) < BELIEVED, nis

    def _update(self, graph: Foreign, guess: Array) -> None:
        values = self._gtsam.Values()
        values.insert(self._node, guess / UNIT)
        self._smoother.update(graph, values, {self._node: self._elapsed_s})
        self._x = UNIT * self._smoother.calculateEstimateVector(self._node)
        self._before = self._x
        self._stretch = Stretch(self._x, self.noise)

    def _between(self, before: int, stretch: Stretch) -> Foreign:
        covariance = stretch.covariance(float(self._before[0])) / np.outer(UNIT, UNIT)
        after, eye = self._node, np.eye(len(UNIT))

        def error(factor: Foreign, values: Foreign, jacobians: list[Array] | None) -> Array:
            del factor
            predicted, by = stretch.predict(UNIT * values.atVector(before))
            if jacobians is not None:
                jacobians[0], jacobians[1] = -by * UNIT / UNIT[:, None], eye
            return np.asarray(values.atVector(after) - predicted / UNIT)

        noise = self._gtsam.noiseModel.Gaussian.Covariance(covariance)
        return self._gtsam.CustomFactor(noise, [before, after], error)

    def _resting(self, stretch: Stretch) -> Foreign:
        density = np.array([self.noise.gyro_density_rad_s_rthz, *(self.noise.acc_density_m_s2_rthz,) * 2])
        mean = stretch.rest_sum / stretch.rest_s
        return self._unary(
            lambda x: (at_rest(x) - mean, at_rest_jacobian(x)), np.diag(density**2 / stretch.rest_s)
        )

    def _unary(self, model: Model, noise: Foreign) -> Foreign:
        """A factor on the newest node: its error and derivative, its noise as covariance or as a model."""
        key = self._node
        if isinstance(noise, np.ndarray):
            noise = self._gtsam.noiseModel.Gaussian.Covariance(noise)

        def error(factor: Foreign, values: Foreign, jacobians: list[Array] | None) -> Array:
            del factor
            off, by = model(UNIT * values.atVector(key))
            if jacobians is not None:
                jacobians[0] = by * UNIT
            return off

        return self._gtsam.CustomFactor(noise, [key], error)
