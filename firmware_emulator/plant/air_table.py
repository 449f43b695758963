"""The table's surface and the floor under it: what pulls a vehicle that no valve pushes."""

import math
from bisect import bisect_right
from dataclasses import dataclass

import numpy as np

GRAVITY_M_S2 = 9.80665  # standard gravity (CGPM 1901)
NS_PER_S = 1_000_000_000
_WAVES = 10
_LONGEST_OVER_SHORTEST = 4.0


@dataclass(frozen=True, slots=True)
class _Wave:
    """One plane wave of the surface's height, by its gradient's amplitude."""

    kx_rad_m: float
    ky_rad_m: float
    phase_rad: float
    gradient_x: float
    gradient_y: float


class Surface:
    """Gradient of the table's height: a mean tilt and a smooth random field, drawn once.

    The field is a sum of plane waves with random directions and phases, so it is smooth, repeatable and
    has no grid. Each wave contributes equally to the gradient's variance.
    """

    def __init__(
        self,
        tilt_rad: tuple[float, float],
        waviness_rad: float,
        shortest_wavelength_m: float,
        rng: np.random.Generator,
    ) -> None:
        self._tilt_x, self._tilt_y = tilt_rad
        # Over directions a wave's x gradient has variance amplitude^2 / 4 (mean of cos^2 twice).
        amplitude = 2.0 * waviness_rad / math.sqrt(_WAVES)
        self._waves: list[_Wave] = []
        for index in range(_WAVES if waviness_rad > 0.0 else 0):
            # Directions are stratified, not free: else a small number of waves favours one axis.
            direction_rad = math.pi * (index + rng.uniform()) / _WAVES
            wavelength_m = shortest_wavelength_m * _LONGEST_OVER_SHORTEST ** rng.uniform()
            k_rad_m = 2.0 * math.pi / wavelength_m
            kx, ky = math.cos(direction_rad), math.sin(direction_rad)
            phase_rad = rng.uniform(0.0, 2.0 * math.pi)
            self._waves.append(_Wave(k_rad_m * kx, k_rad_m * ky, phase_rad, amplitude * kx, amplitude * ky))

    def gradient(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Gradient (dh/dx, dh/dy) of the surface's height at a point of the table frame."""
        gradient_x, gradient_y = self._tilt_x, self._tilt_y
        for wave in self._waves:
            cosine = math.cos(wave.kx_rad_m * x_m + wave.ky_rad_m * y_m + wave.phase_rad)
            gradient_x += wave.gradient_x * cosine
            gradient_y += wave.gradient_y * cosine
        return gradient_x, gradient_y

    def slope_acceleration(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Acceleration of a body that glides there unpushed, table frame, m/s^2."""
        gradient_x, gradient_y = self.gradient(x_m, y_m)
        return -GRAVITY_M_S2 * gradient_x, -GRAVITY_M_S2 * gradient_y


class FloorPulses:
    """Shocks of the floor: the table jerks one way and back within a moment.

    Seen from the table a gliding vehicle is accelerated the other way, and its accelerometer feels
    nothing; a landed vehicle is carried along and feels it. So a shock acts exactly like a slope.
    """

    def __init__(
        self, rate_hz: float, deviation_m_s2: float, duration_s: float, rng: np.random.Generator
    ) -> None:
        self._rate_hz = rate_hz
        self._deviation_m_s2 = deviation_m_s2
        self._half_ns = max(1, round(0.5 * duration_s * NS_PER_S))
        self._rng = rng
        self._edges_ns: list[int] = [0]
        self._values: list[tuple[float, float]] = [(0.0, 0.0)]  # from each edge to the next

    def acceleration(self, stamp_ns: int) -> tuple[float, float]:
        """Apparent acceleration of a gliding body in the table frame at `stamp_ns`, m/s^2."""
        if self._rate_hz <= 0.0:
            return 0.0, 0.0
        self._draw_past(stamp_ns)
        return self._values[max(0, bisect_right(self._edges_ns, stamp_ns) - 1)]

    def next_change_ns(self, stamp_ns: int) -> int | None:
        """First moment after `stamp_ns` at which the acceleration changes; None for a quiet floor."""
        if self._rate_hz <= 0.0:
            return None
        self._draw_past(stamp_ns)
        return self._edges_ns[bisect_right(self._edges_ns, stamp_ns)]

    def _draw_past(self, stamp_ns: int) -> None:
        while self._edges_ns[-1] <= stamp_ns:
            gap_ns = 1 + round(self._rng.exponential(1.0 / self._rate_hz) * NS_PER_S)
            ax, ay = self._deviation_m_s2 * self._rng.standard_normal(2)
            start_ns = self._edges_ns[-1] + gap_ns
            for edge, value in (
                (start_ns, (float(ax), float(ay))),
                (start_ns + self._half_ns, (-float(ax), -float(ay))),
                (start_ns + 2 * self._half_ns, (0.0, 0.0)),
            ):
                self._edges_ns.append(edge)
                self._values.append(value)
