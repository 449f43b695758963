"""What a late fix does to state and covariance: what the core's late fix must agree with.

To rounding, which inversions enlarge: 1e-7 relative, or 1e-10 of the largest element.
"""

import math

import numpy as np
from numpy.typing import NDArray

from groundstation.fusion import error_state as es
from groundstation.fusion.late_fix import Correction
from groundstation.fusion.learned_surface import LearnedSurface, look
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.trace import Looked

Array = NDArray[np.float64]


class OracleLateFix:
    """As ``late_fix.LateFix``."""

    def __init__(self, noise: NoiseModel) -> None:
        self._noise = noise

    def look(
        self, surface: LearnedSurface, x: Array, P: Array, place_m: Array
    ) -> tuple[LearnedSurface, Array, Array, Looked]:
        return look(surface, x, P, place_m, self._noise)

    def slope(self, surface: LearnedSurface, x: Array, place_m: Array) -> Array:
        return slope(surface, x, place_m)

    def correct(self, x: Array, P: Array, z: Array, H: Array, R: Array, gate: float) -> Correction:
        PH = P[:, : es.SIZE] @ H.T
        S = H @ PH[: es.SIZE] + R
        weight = np.asarray(np.linalg.inv(S), dtype=np.float64)
        K = PH @ weight
        nis = float(z @ weight @ z)
        if nis <= gate:
            x += K @ z
            P -= K @ S @ K.T
            P[:] = 0.5 * (P + P.T)
        return Correction(nis, S, weight, K)

    def variance_in_time(self, x: Array, P: Array, noise: NoiseModel) -> list[float]:
        return variance_in_time(x, P, noise)


def slope(surface: LearnedSurface, x: Array, place_m: Array) -> Array:
    """Return the expected slope (2,) at a place, given the filter's state (23 + 2m,)."""
    d = (place_m - surface.nodes_m) / surface.length_m
    near = np.exp(-0.5 * np.einsum("ij,ij->i", d, d))
    pull = (surface.inverse @ x[es.SIZE :]).reshape(-1, 2)
    return np.asarray(near @ pull - (near * np.einsum("ij,ij->i", d, pull)) @ d)


def variance_in_time(x: Array, P: Array, noise: NoiseModel) -> list[float]:
    """Return polynomial coefficients of the variances of x, y (five each) and heading (three).

    The argument is the time in s since P held. The error of a position grows as p + v t + a t^2 / 2 with the
    constant error a of biases and slope, plus white noise; evaluating that costs a microsecond where carrying
    a covariance would cost a hundred.
    """
    c, s = math.cos(x[es.THETA]), math.sin(x[es.THETA])
    rx, ry = x[es.LEVER_X], x[es.LEVER_Y]
    L = np.zeros((6, es.SIZE))  # x and y: position of the centre of mass, velocity, constant acceleration
    L[0, es.PX] = L[1, es.PY] = L[2, es.VX] = L[3, es.VY] = 1.0
    L[0, es.THETA], L[1, es.THETA] = s * rx + c * ry, s * ry - c * rx
    L[0, es.LEVER_X] = L[1, es.LEVER_Y] = L[4, es.ACC_BIAS_X] = L[5, es.ACC_BIAS_Y] = -c
    L[0, es.LEVER_Y] = L[4, es.ACC_BIAS_Y] = s
    L[1, es.LEVER_X] = L[5, es.ACC_BIAS_X] = -s
    L[4, es.SLOPE_X] = L[4, es.WAVE_X] = L[5, es.SLOPE_Y] = L[5, es.WAVE_Y] = 1.0
    C = L @ P[: es.SIZE, : es.SIZE] @ L.T
    white = noise.acc_density_m_s2_rthz**2 / 3.0
    out: list[float] = []
    for p, v, a in ((0, 2, 4), (1, 3, 5)):
        out += [C[p, p], 2.0 * C[p, v], C[v, v] + C[p, a], C[v, a] + white, C[a, a] / 4.0]
    g = es.GYRO_BIAS
    out += [P[0, 0], noise.gyro_density_rad_s_rthz**2 - 2.0 * P[0, g], P[g, g]]
    return [float(value) for value in out]
