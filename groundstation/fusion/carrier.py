"""State and covariance over a stretch of stored packets, in one call of the core (``carry.c``)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.core.library import default_core
from groundstation.fusion.error_state import MOVING, SIZE
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.packet_history import PacketHistory
from groundstation.fusion.slope_grid import SlopeGrid
from groundstation.fusion.valve_knocks import group_of, step_of

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """What a stretch of flight does to state and covariance."""

    duration_s: float
    moved: Array
    """(5,) theta, vx, vy, px, py at the end."""
    turned_rad: float
    """From the start to the middle of the last packet."""
    rows: Array
    """(5, 23) moving rows of the error transition."""
    noise: Array
    """(5, 5) process covariance that sensors, holes and valves add to the moving states."""


class Carrier:
    """Integrates the stored packets between two moments, with what the covariance needs or without.

    Args:
        noise: of the sensors.
        table_map: what is known of the slope beforehand.

    Raises:
        CoreError: there is no core.
    """

    def __init__(self, noise: NoiseModel, table_map: SlopeGrid | None) -> None:
        core = default_core()
        self._ffi = ffi = core.ffi
        self._fly, self._carry = core.lib.gs_stretch_fly, core.lib.gs_stretch_carry
        self._stretch = stretch = ffi.new("Stretch *")
        stretch.lag_difference_s = noise.gyro_lag_s - noise.acc_lag_s
        stretch.gyro_density = noise.gyro_density_rad_s_rthz
        stretch.acc_density = noise.acc_density_m_s2_rthz
        stretch.knock_m_s, stretch.knock_step_m_s2 = noise.valve_knock_m_s, step_of(noise)
        stretch.knock_group = group_of(noise)
        self._x, self._moved, rows, added = (
            np.frombuffer(ffi.buffer(field)) for field in (stretch.x, stretch.moved, stretch.F, stretch.Q)
        )
        self._rows, self._added = rows.reshape(MOVING, SIZE), added.reshape(MOVING, MOVING)
        if table_map is not None:
            # held here as long as the core may look at them
            self._fields = [
                ffi.from_buffer("double[]", np.ascontiguousarray(field, dtype=np.float64))
                for field in (table_map.pull_x_m_s2, table_map.pull_y_m_s2)
            ]
            rows_columns = table_map.pull_x_m_s2.shape
            place = (table_map.x0_m, table_map.y0_m, table_map.step_m, *table_map.mean_m_s2)
            self._grid = ffi.new("Grid *", (*self._fields, *rows_columns, *place))
            stretch.map = self._grid

    def carry(self, x: Array, history: PacketHistory, start_s: float, stop_s: float) -> Stretch | None:
        """Return what a stretch does to the state (>= 23,) at its start; None where there are no packets."""
        if not self._called(self._carry, x, history, start_s, stop_s):
            return None
        stretch = self._stretch
        moved, rows, added = self._moved.copy(), self._rows.copy(), self._added.copy()
        return Stretch(stretch.duration_s, moved, stretch.turned_rad, rows, added)

    def fly(self, x: Array, history: PacketHistory, start_s: float, stop_s: float) -> Array | None:
        """Return theta, vx, vy, px, py (5,) at the end of a stretch; None where there are no packets."""
        found = self._called(self._fly, x, history, start_s, stop_s)
        return self._moved.copy() if found else None

    def _called(
        self, function: Callable[[Any], int], x: Array, history: PacketHistory, start_s: float, stop_s: float
    ) -> bool:
        stretch = self._stretch
        # by address: a view of the rows would keep them from growing
        stretch.history = self._ffi.cast("Packet *", history.rows.buffer_info()[0])
        stretch.count = len(history)
        stretch.start_s, stretch.stop_s = start_s, stop_s
        self._x[:] = x[:SIZE]
        return function(stretch) > 0
