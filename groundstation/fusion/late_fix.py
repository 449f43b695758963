"""What a late fix does to state and covariance: in the compiled core, or by NumPy.

The stretch of packets before it is `carrier`'s. States x are (23 + 2m,), covariances P (23 + 2m, 23 + 2m) and
contiguous, with m nodes of the learned surface.
"""

from __future__ import annotations

from ctypes import c_double, c_int, c_int64, c_void_p
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.core.library import Core, CoreError
from groundstation.fusion.error_state import SIZE
from groundstation.fusion.learned_surface import MAX_NODES, UNKNOWN_SHARE, LearnedSurface, look
from groundstation.fusion.measurements import variance_in_time
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.trace import Looked

Array = NDArray[np.float64]


CORE_NODES = 64
"""``MAX_NODES`` of late_fix.c."""


class Correction(NamedTuple):
    """By a fix."""

    nis: float
    """Normalised innovation squared; above the gate nothing was corrected."""
    S: Array
    """(3, 3) covariance of the innovation."""
    weight: Array
    """(3, 3) its inverse."""
    K: Array
    """(23 + 2m, 3) gain."""


class LateFix:
    """The steps at an exposure and after it.

    Args:
        noise: of sensors and table.
        core: a compiled one, or ``PURE``; both give the same to rounding, which inversions enlarge:
            1e-7 relative, or 1e-10 of the largest element.

    Raises:
        CoreError: the core does not fit.
    """

    def __init__(self, noise: NoiseModel, core: Core) -> None:
        self._noise = noise
        self._wave_variance = noise.waviness_sigma_m_s2**2
        self._is_compiled = core.is_compiled
        self._surface: LearnedSurface | None = None
        if not core.is_compiled:
            return
        if MAX_NODES > CORE_NODES:
            raise CoreError(
                f"the compiled core has room for {CORE_NODES} nodes of a surface, not {MAX_NODES}"
            )
        address, place = c_void_p, (c_double, c_double)
        nodes = (address, address, c_int64, c_double)
        self._look = core.function(
            "gs_surface_look", c_int, *nodes, *place, c_double, c_double, address, address, address
        )
        self._slope = core.function("gs_surface_slope", None, *nodes, *place, address, address)
        self._correct = core.function(
            "gs_correct", c_double, address, address, c_int64, *[address] * 3, c_double, address, address
        )
        self._variance = core.function(
            "gs_variance_in_time", None, address, address, c_int64, c_double, c_double, address
        )
        self._pair, self._coefficients = np.empty(2), np.empty(13)
        self._pair_at, self._coefficients_at = self._pair.ctypes.data, self._coefficients.ctypes.data

    def look(
        self, surface: LearnedSurface, x: Array, P: Array, place_m: Array
    ) -> tuple[LearnedSurface, Array, Array, Looked]:
        """Let the local slope be that of a place; see `learned_surface.look`."""
        if self._is_compiled and len(surface.nodes_m):
            w = np.empty((2, len(x) - SIZE))
            share = (self._wave_variance, UNKNOWN_SHARE)
            at = place_m.tolist()
            if self._look(*self._nodes(surface), *at, *share, x.ctypes.data, P.ctypes.data, w.ctypes.data):
                return surface, x, P, Looked(w, None, None)
        return look(surface, x, P, place_m, self._noise)

    def slope(self, surface: LearnedSurface, x: Array, place_m: Array) -> Array:
        """Return the expected slope (2,) at a place."""
        if not self._is_compiled:
            return surface.slope(x, place_m)
        at_nodes = x.ctypes.data + SIZE * x.itemsize
        self._slope(*self._nodes(surface), *place_m.tolist(), at_nodes, self._pair_at)
        return self._pair

    def correct(self, x: Array, P: Array, z: Array, H: Array, R: Array, gate: float) -> Correction:
        """Correct x and P in place by a fix, unless it lies outside the gate.

        Args:
            x: nominal state.
            P: covariance.
            z: (3,) innovation.
            H: (3, 23) its Jacobian.
            R: (3, 3) covariance of the fix.
            gate: largest normalised innovation squared.
        """
        if self._is_compiled:
            S, weight, K = np.array(R), np.empty((3, 3)), np.empty((len(x), 3))
            nis = self._correct(
                x.ctypes.data, P.ctypes.data, len(x), z.ctypes.data, H.ctypes.data, S.ctypes.data, gate,
                weight.ctypes.data, K.ctypes.data,
            )  # fmt: skip
            return Correction(nis, S, weight, K)
        PH = P[:, :SIZE] @ H.T
        S = H @ PH[:SIZE] + R
        weight = np.asarray(np.linalg.inv(S), dtype=np.float64)
        K = PH @ weight
        nis = float(z @ weight @ z)
        if nis <= gate:
            x += K @ z
            P -= K @ S @ K.T
            P[:] = 0.5 * (P + P.T)
        return Correction(nis, S, weight, K)

    def variance_in_time(self, x: Array, P: Array, noise: NoiseModel) -> list[float]:
        """Return polynomial coefficients; see `measurements.variance_in_time`."""
        if not self._is_compiled:
            return variance_in_time(x, P, noise)
        densities = (noise.acc_density_m_s2_rthz, noise.gyro_density_rad_s_rthz)
        self._variance(x.ctypes.data, P.ctypes.data, len(x), *densities, self._coefficients_at)
        return self._coefficients.tolist()

    def _nodes(self, surface: LearnedSurface) -> tuple[int, int, int, float]:
        """Addresses of a surface's nodes and inverse, their number, the length; the surface is kept alive."""
        if surface is not self._surface:
            self._surface = surface
            self._kept = np.ascontiguousarray(surface.nodes_m), np.ascontiguousarray(surface.inverse)
            nodes, inverse = self._kept
            self._found = nodes.ctypes.data, inverse.ctypes.data, len(nodes), surface.length_m
        return self._found
