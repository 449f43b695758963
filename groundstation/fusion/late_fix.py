"""What a late fix does to state and covariance, in the core (``late_fix.c``).

The stretch of packets before it is `carrier`'s. States x are (23 + 2m,), covariances P (23 + 2m, 23 + 2m) and
contiguous, with m nodes of the learned surface.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.core.library import default_core
from groundstation.fusion.error_state import SIZE
from groundstation.fusion.learned_surface import UNKNOWN_SHARE, LearnedSurface, look
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.trace import Looked

Array = NDArray[np.float64]


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

    Raises:
        CoreError: there is no core.
    """

    def __init__(self, noise: NoiseModel) -> None:
        core = default_core()
        self._lib, self._view = core.lib, core.ffi.from_buffer
        self._noise = noise
        self._wave_variance = noise.waviness_sigma_m_s2**2
        self._surface: LearnedSurface | None = None
        self._pair = np.empty(2)
        self._pair_at, self._coefficients = self._at(self._pair), core.ffi.new("double[13]")

    def look(
        self, surface: LearnedSurface, x: Array, P: Array, place_m: Array
    ) -> tuple[LearnedSurface, Array, Array, Looked]:
        """Let the local slope be that of a place; see `learned_surface.look`."""
        if len(surface.nodes_m):
            w = np.empty((2, len(x) - SIZE))
            share = (self._wave_variance, UNKNOWN_SHARE)
            arrays = (self._at(x), self._at(P), self._at(w))
            if self._lib.gs_surface_look(*self._nodes(surface), *place_m.tolist(), *share, *arrays):
                return surface, x, P, Looked(w, None, None)
        return look(surface, x, P, place_m, self._noise)

    def slope(self, surface: LearnedSurface, x: Array, place_m: Array) -> Array:
        """Return the expected slope (2,) at a place."""
        at_nodes = self._at(x) + SIZE
        self._lib.gs_surface_slope(*self._nodes(surface), *place_m.tolist(), at_nodes, self._pair_at)
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
        S, weight, K = np.array(R), np.empty((3, 3)), np.empty((len(x), 3))
        at = self._at
        nis = self._lib.gs_correct(at(x), at(P), len(x), at(z), at(H), at(S), gate, at(weight), at(K))
        return Correction(nis, S, weight, K)

    def variance_in_time(self, x: Array, P: Array, noise: NoiseModel) -> list[float]:
        """Return polynomial coefficients of the variances of x, y (five each) and heading (three).

        The argument is the time in s since P held. The error of a position grows as p + v t + a t^2 / 2 with
        the constant error a of biases and slope, plus white noise; evaluating that costs a microsecond where
        carrying a covariance would cost a hundred.
        """
        densities = (noise.acc_density_m_s2_rthz, noise.gyro_density_rad_s_rthz)
        self._lib.gs_variance_in_time(self._at(x), self._at(P), len(x), *densities, self._coefficients)
        return list(self._coefficients)

    def _at(self, array: Array) -> Any:  # noqa: ANN401 - a pointer of cffi
        """Where a contiguous array's numbers are; the pointer keeps the array alive."""
        return self._view("double[]", array)

    def _nodes(self, surface: LearnedSurface) -> tuple[Any, Any, int, float]:
        """A surface's nodes and inverse, their number, the length; the surface is kept alive."""
        if surface is not self._surface:
            self._surface = surface
            nodes, inverse = (np.ascontiguousarray(part) for part in (surface.nodes_m, surface.inverse))
            self._found = self._at(nodes), self._at(inverse), len(nodes), surface.length_m
        return self._found
