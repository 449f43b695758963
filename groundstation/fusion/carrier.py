"""State and covariance over a stretch of stored packets: in one call of the compiled core, or by NumPy."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.core.library import Core, CoreError
from groundstation.fusion.error_state import MOVING, SIZE
from groundstation.fusion.flight import fly, moving_noise, transition
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.packet_history import PacketHistory
from groundstation.fusion.slope_grid import SlopeGrid
from groundstation.fusion.valve_knocks import add_knocks, group_of, step_of

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


class _Grid(ctypes.Structure):
    """``Grid`` of carry.c, field by field."""

    _fields_ = (
        ("x", ctypes.c_void_p),
        ("y", ctypes.c_void_p),
        ("rows", ctypes.c_int64),
        ("columns", ctypes.c_int64),
        *((name, ctypes.c_double) for name in ("x0_m", "y0_m", "step_m", "mean_x", "mean_y")),
    )


class _Memory(ctypes.Structure):
    """``Stretch`` of carry.c, field by field."""

    _fields_ = (
        ("history", ctypes.c_void_p),
        ("count", ctypes.c_int64),
        *((name, ctypes.c_double) for name in (
            "start_s", "stop_s", "lag_difference_s", "gyro_density", "acc_density",
            "knock_m_s", "knock_step_m_s2",
        )),
        ("knock_group", ctypes.c_int64),
        ("map", ctypes.c_void_p),
        ("x", ctypes.c_double * SIZE),
        ("moved", ctypes.c_double * MOVING),
        ("duration_s", ctypes.c_double),
        ("turned_rad", ctypes.c_double),
        ("rows", ctypes.c_double * (MOVING * SIZE)),
        ("noise", ctypes.c_double * MOVING**2),
        ("first", ctypes.c_int64),
        ("last", ctypes.c_int64),
    )  # fmt: skip


class Carrier:
    """Integrates the stored packets between two moments, with what the covariance needs or without.

    Args:
        noise: of the sensors.
        table_map: what is known of the slope beforehand.
        core: a compiled one; with ``PURE`` the functions of `flight` are called. Both give the same
            to rounding: 1e-9 relative, or 1e-12 of the largest element.

    Raises:
        CoreError: the core does not fit.
    """

    def __init__(self, noise: NoiseModel, table_map: SlopeGrid | None, core: Core) -> None:
        self._noise = noise
        self._map = table_map
        self._lag_difference_s = noise.gyro_lag_s - noise.acc_lag_s
        self._is_compiled = core.is_compiled
        if core.is_compiled:
            self._prepare(core)

    def _prepare(self, core: Core) -> None:
        for name, kind in (("gs_stretch_size", _Memory), ("gs_grid_size", _Grid)):
            if core.function(name, ctypes.c_size_t)() != ctypes.sizeof(kind):
                raise CoreError(f"{name} of the compiled core is not {ctypes.sizeof(kind)}")
        self._fly = core.function("gs_stretch_fly", ctypes.c_int64, ctypes.c_void_p)
        self._carry = core.function("gs_stretch_carry", ctypes.c_int64, ctypes.c_void_p)
        self._memory = memory = _Memory()
        self._address = ctypes.addressof(memory)
        memory.lag_difference_s = self._lag_difference_s
        memory.gyro_density = self._noise.gyro_density_rad_s_rthz
        memory.acc_density = self._noise.acc_density_m_s2_rthz
        memory.knock_m_s, memory.knock_step_m_s2 = self._noise.valve_knock_m_s, step_of(self._noise)
        memory.knock_group = group_of(self._noise)
        self._x, self._moved = np.frombuffer(memory.x), np.frombuffer(memory.moved)
        self._rows = np.frombuffer(memory.rows).reshape(MOVING, SIZE)
        self._added = np.frombuffer(memory.noise).reshape(MOVING, MOVING)
        known = self._map
        if known is not None:
            # held here as long as the core may look at them
            self._fields = [
                np.ascontiguousarray(f, dtype=np.float64) for f in (known.pull_x_m_s2, known.pull_y_m_s2)
            ]
            rows, columns = self._fields[0].shape
            x, y = (field.ctypes.data for field in self._fields)
            self._grid = _Grid(x, y, rows, columns, known.x0_m, known.y0_m, known.step_m, *known.mean_m_s2)
            memory.map = ctypes.addressof(self._grid)

    def carry(self, x: Array, history: PacketHistory, start_s: float, stop_s: float) -> Stretch | None:
        """Return what a stretch does to the state (>= 23,) at its start; None where there are no packets."""
        if self._is_compiled:
            if not self._called(self._carry, x, history, start_s, stop_s):
                return None
            memory = self._memory
            moved, rows, added = self._moved.copy(), self._rows.copy(), self._added.copy()
            return Stretch(memory.duration_s, moved, memory.turned_rad, rows, added)
        segment = history.between(start_s, stop_s)
        if not len(segment.span_s):
            return None
        flight = fly(x, segment, self._lag_difference_s, self._map)
        rows, added = transition(segment, flight), moving_noise(segment, flight, self._noise)
        add_knocks(added, segment, flight, self._noise)
        return Stretch(flight.duration_s, flight.moved, float(flight.turned[-1]), rows, added)

    def fly(self, x: Array, history: PacketHistory, start_s: float, stop_s: float) -> Array | None:
        """Return theta, vx, vy, px, py (5,) at the end of a stretch; None where there are no packets."""
        if self._is_compiled:
            found = self._called(self._fly, x, history, start_s, stop_s)
            return self._moved.copy() if found else None
        segment = history.between(start_s, stop_s)
        return fly(x, segment, self._lag_difference_s, self._map).moved if len(segment.span_s) else None

    def _called(
        self, function: Callable[[int], int], x: Array, history: PacketHistory, start_s: float, stop_s: float
    ) -> bool:
        memory = self._memory
        memory.history, _ = history.rows.buffer_info()
        memory.count = len(history)
        memory.start_s, memory.stop_s = start_s, stop_s
        self._x[:] = x[:SIZE]
        return function(self._address) > 0
