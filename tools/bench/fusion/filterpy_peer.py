"""filterpy's KalmanFilter as a textbook user would take it: predict per packet, update per fix."""

import importlib

import numpy as np

from bench.fusion.late import LatePeer
from bench.fusion.planar import (
    SIZE,
    Array,
    Reading,
    at_rest,
    at_rest_jacobian,
    moved,
    pose_jacobian,
    prior_variance,
    process_noise,
    transition,
)
from groundstation.fusion.estimator import Fix
from groundstation.fusion.noise import NoiseModel

GATE = 25.0
REOPEN_AFTER = 4
REOPENED_SIGMA = (0.1, 0.05, 0.05, 0.3, 0.3)
"""Of heading, velocity and position when refused fixes have proved the filter wrong."""


class FilterpyPeer(LatePeer):
    """Extended by linearising outside of it; a gate that opens after four refusals in a row.

    Raises:
        ImportError: filterpy is not installed.
    """

    def __init__(self, noise: NoiseModel) -> None:
        super().__init__(noise)
        self._filter = importlib.import_module("filterpy.kalman").KalmanFilter(dim_x=SIZE, dim_z=3)
        self._refusals = 0

    def _start(self) -> None:
        self._filter.P = np.diag(prior_variance(self.noise))
        self._took()

    def _advance(self, reading: Reading) -> None:
        if self.is_at_rest(reading):
            density = self.noise.gyro_density_rad_s_rthz, *(self.noise.acc_density_m_s2_rthz,) * 2
            seen = np.array([reading.rate_rad_s, reading.ax_m_s2, reading.ay_m_s2])
            self._update(
                at_rest_jacobian(self._x), seen - at_rest(self._x), np.diag(np.square(density) / reading.dt_s)
            )
            return
        step = transition(self._x, reading)
        self._filter.predict(F=step, Q=process_noise(self.noise, reading.dt_s))
        self._x = moved(self._x, reading)

    def _correct(self, fix: Fix, innovation: Array) -> tuple[bool, float]:
        jacobian = pose_jacobian(self._x, self.noise)
        spread = jacobian @ self._filter.P @ jacobian.T + fix.covariance
        nis = float(innovation @ np.linalg.solve(spread, innovation))
        is_used = nis < GATE or self._refusals >= REOPEN_AFTER
        if nis >= GATE and is_used:
            self._filter.P[range(5), range(5)] += np.square(REOPENED_SIGMA)
        self._refusals = 0 if is_used else self._refusals + 1
        if is_used:
            self._update(jacobian, innovation, fix.covariance)
        self._took()
        return is_used, nis

    def _update(self, jacobian: Array, innovation: Array, covariance: Array) -> None:
        """By the linear filter: its state is ours, its measurement what would give the innovation."""
        self._filter.x = self._x[:, None]
        self._filter.update((innovation + jacobian @ self._x)[:, None], R=covariance, H=jacobian)
        self._x = np.array(self._filter.x[:, 0])

    def _took(self) -> None:
        self._sigma = np.sqrt(np.diag(self._filter.P)[[3, 4, 0]])
