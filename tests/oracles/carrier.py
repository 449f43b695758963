"""State and covariance over a stretch of stored packets: what the core's carrier must agree with.

To rounding: 1e-9 relative, or 1e-12 of the largest element.
"""

import numpy as np
from numpy.typing import NDArray

from groundstation.fusion.carrier import Stretch
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.packet_history import PacketHistory
from groundstation.fusion.slope_grid import SlopeGrid
from oracles.flight import fly, moving_noise, transition
from oracles.valve_knocks import add_knocks

Array = NDArray[np.float64]


class OracleCarrier:
    """As ``carrier.Carrier``."""

    def __init__(self, noise: NoiseModel, table_map: SlopeGrid | None) -> None:
        self._noise, self._map = noise, table_map
        self._lag_difference_s = noise.gyro_lag_s - noise.acc_lag_s

    def carry(self, x: Array, history: PacketHistory, start_s: float, stop_s: float) -> Stretch | None:
        segment = history.between(start_s, stop_s)
        if not len(segment.span_s):
            return None
        flight = fly(x, segment, self._lag_difference_s, self._map)
        rows, added = transition(segment, flight), moving_noise(segment, flight, self._noise)
        add_knocks(added, segment, flight, self._noise)
        return Stretch(flight.duration_s, flight.moved, float(flight.turned[-1]), rows, added)

    def fly(self, x: Array, history: PacketHistory, start_s: float, stop_s: float) -> Array | None:
        segment = history.between(start_s, stop_s)
        return fly(x, segment, self._lag_difference_s, self._map).moved if len(segment.span_s) else None
