"""A recording smoothed: the filter forwards, then its trace backwards."""

from __future__ import annotations

import numpy as np

from groundstation.fusion import error_state as es
from groundstation.fusion.error_state_filter import ErrorStateFilter
from groundstation.fusion.estimator import Array, Fix, FixOutcome, ImuPacket, Pair, PlanarState
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.slope_grid import SlopeGrid
from groundstation.fusion.smoother import Smoothed, smooth
from groundstation.fusion.trace import Trace


class OfflineSmoother:
    """Behaves as the filter while it is fed, and then knows better.

    Args:
        noise: sensors and table of this mock-up.
        table_map: what calibration knows of the table's slope.
    """

    def __init__(self, noise: NoiseModel, table_map: SlopeGrid | None = None) -> None:
        self.noise = noise
        self.trace = Trace()
        self._map = table_map
        self._filter = ErrorStateFilter(noise, self.trace, table_map)
        self.counters = self._filter.counters
        self._rows: list[tuple[int, float, int]] = []
        """Of each packet its stamp, how far that lies from its tick, and its row in the history or -1."""
        self._is_finished = False

    def begin_rest(self, t_ns: int) -> None:
        """Say that from this stamp the vehicle stands still."""
        self._filter.begin_rest(t_ns)

    def end_rest(self, t_ns: int) -> None:
        """Say that from this stamp the vehicle may move."""
        self._filter.end_rest(t_ns)

    def add_imu(self, packet: ImuPacket) -> PlanarState | None:
        """Take one packet; what is returned is the causal state."""
        before = len(self._filter.history)
        state = self._filter.add_imu(packet)
        after = len(self._filter.history)
        row = after - 1 if after > before else -1
        self._rows.append((packet.t_ns, self._filter.stamp_off_s if row >= 0 else 0.0, row))
        return state

    def add_fix(self, fix: Fix) -> FixOutcome:
        """Take a fix."""
        return self._filter.add_fix(fix)

    def settled(self) -> list[FixOutcome]:
        """Hand over the accounts of fixes that had to wait."""
        return self._filter.settled()

    def state(self) -> PlanarState | None:
        """Return the causal state after the newest packet."""
        return self._filter.state()

    def covariance(self) -> Array:
        """Return the causal covariance (6, 6) at the newest packet."""
        return self._filter.covariance()

    def doubt_forces(self, t_ns: int, *, x: bool, y: bool) -> None:
        """Say which accelerometers are not believed from this stamp on."""
        self._filter.doubt_forces(t_ns, x=x, y=y)

    def expected_forces(self, rate_rad_s: float, push_m_s2: Pair, turn_rad_s2: float) -> Pair:
        """Return what the accelerometers would read under a known push."""
        return self._filter.expected_forces(rate_rad_s, push_m_s2, turn_rad_s2)

    def slope_left(self) -> tuple[float, float]:
        """Return the table's pull beyond the map, causal."""
        return self._filter.slope_left()

    def sigmas(self) -> Array:
        """Return (23,) sigmas of the error states at the last used fix, causal."""
        return np.asarray(np.sqrt(np.maximum(np.diag(self._filter.P)[: es.SIZE], 0.0)))

    def finish(self) -> Smoothed:
        """End the recording and smooth it."""
        if not self._is_finished:
            self._filter.finish()
            self._is_finished = True
        return smooth(self.trace, self._filter.history, self.noise, self._map)

    def states(self) -> list[PlanarState | None]:
        """End the recording; return the smoothed state for each packet given, None where there is none."""
        smoothed = self.finish()
        rows = np.array([row for _, _, row in self._rows], dtype=np.intp)
        off = np.array([off_s for _, off_s, _ in self._rows])[:, None]
        state = smoothed.state[rows]
        state[:, :2] += off * state[:, 3:5]
        state[:, 2:3] += off * state[:, 5:6]
        values, sigmas = state.tolist(), smoothed.sigma[rows].tolist()
        return [
            None if row < 0 or value[0] != value[0] else PlanarState._make([t_ns, *value, *sigma, False])
            for (t_ns, _, row), value, sigma in zip(self._rows, values, sigmas, strict=True)
        ]
