"""Stretches in which an accelerometer was not believed: forces as large as the thrust may act unseen."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.fusion.error_state import MOVING, PX, PY, THETA, VX, VY

Array = NDArray[np.float64]


class _Stretch(NamedTuple):
    start_s: float
    stop_s: float
    x: bool
    y: bool
    turn_rad2: float = 0.0
    """Variance of the turn over all of it."""


class ForceDoubt:
    """Remembers when which body axis was not measured, and what that adds to the process noise.

    Args:
        density_m_s2_rthz: of the specific force that no reading shows, taken as white.
    """

    def __init__(self, density_m_s2_rthz: float) -> None:
        self._power = density_m_s2_rthz**2
        self._stretches: list[_Stretch] = []

    @property
    def is_open(self) -> bool:
        """Whether an axis is not believed now."""
        return bool(self._stretches) and math.isinf(self._stretches[-1].stop_s)

    def change(self, t_s: float, *, x: bool, y: bool) -> None:
        """Say which axes are not believed from this time on; none at all ends the doubt."""
        if self.is_open:
            last = self._stretches.pop()
            self._stretches.append(last._replace(stop_s=max(t_s, last.start_s)))
        if x or y:
            self._stretches.append(_Stretch(t_s, math.inf, x, y))

    def missed(self, start_s: float, stop_s: float, turn_sigma_rad: float) -> None:
        """Note a past stretch in which nothing was measured, and how well it is known how far it turned."""
        stretch = _Stretch(start_s, stop_s, x=True, y=True, turn_rad2=turn_sigma_rad**2)
        self._stretches.insert(len(self._stretches) - self.is_open, stretch)

    def forget_before(self, t_s: float) -> None:
        """Drop what ended before."""
        self._stretches = [each for each in self._stretches if each.stop_s > t_s]

    def touches(self, start_s: float, stop_s: float) -> bool:
        """Whether any of an interval was doubtful."""
        return any(each.start_s < stop_s and each.stop_s > start_s for each in self._stretches)

    def noise(self, start_s: float, stop_s: float, heading_rad: float) -> Array | None:
        """Return what an interval adds to the covariance (5, 5) of theta, v and p; None without doubt.

        Args:
            start_s: of the interval.
            stop_s: of the interval, where the covariance holds.
            heading_rad: of the body meanwhile.
        """
        if not self.touches(start_s, stop_s):
            return None
        Q = np.zeros((MOVING, MOVING))
        c, s = math.cos(heading_rad), math.sin(heading_rad)
        for each in self._stretches:
            # white force from `early` to `late` seconds before the end
            early, late = stop_s - max(each.start_s, start_s), stop_s - min(each.stop_s, stop_s)
            if early <= late:
                continue
            if each.turn_rad2:
                Q[THETA, THETA] += each.turn_rad2 * (early - late) / (each.stop_s - each.start_s)
            over = [(early**k - late**k) / k for k in (1, 2, 3)]  # of 1, (time left), (time left)^2
            qx, qy = self._power * each.x, self._power * each.y
            table = np.array(
                [[c * c * qx + s * s * qy, c * s * (qx - qy)], [c * s * (qx - qy), s * s * qx + c * c * qy]]
            )
            v, p = slice(VX, VY + 1), slice(PX, PY + 1)
            Q[v, v] += over[0] * table
            Q[v, p] += over[1] * table
            Q[p, v] += over[1] * table
            Q[p, p] += over[2] * table
        return Q
