"""The hot path in the compiled core: `Reckoner` with the same answers, bit for bit, in a third of the time.

The state lives in a structure that C and Python share; a packet is written into it, one call integrates it,
and the report is read from it.
"""

from __future__ import annotations

import ctypes
import math
from struct import Struct

import numpy as np
from numpy.typing import NDArray

from groundstation.core.library import Core, CoreError
from groundstation.fusion import error_state as es
from groundstation.fusion.backward_stamps import BackwardStamps
from groundstation.fusion.estimator import Counters, ImuPacket, PlanarState
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.packet_history import COLUMNS, PacketHistory
from groundstation.fusion.packet_screen import PacketScreen
from groundstation.fusion.reckoner import LOOKUP_EVERY, MAX_STAMP_JITTER_S, STAMP_GAIN, Reckoner
from groundstation.fusion.slope_grid import SlopeGrid

Array = NDArray[np.float64]

_BEHIND, _WILD, _HOLE, _DISAGREE = 1, 2, 4, 8  # as in reckon.c
_EVENTS = (
    (_WILD, "packet_wild"),
    (_HOLE, "packet_hole"),
    (_DISAGREE, "packet_ticks_and_stamps_disagree"),
)
_pack = Struct("=q5d").pack_into
_pack_state = Struct("=20d").pack_into  # from gyro_bias to py
_unpack_state = Struct("=q12d?").unpack_from
_ROW_BYTES = 8 * COLUMNS


class _Memory(ctypes.Structure):
    """``Reckoner`` of reckon.c, field by field."""

    _fields_ = (
        *((name, ctypes.c_int64 if name.endswith("ns") else ctypes.c_double) for name in (
            "t_ns", "dt_s", "read_omega", "read_ax", "read_ay", "asked_temperature_c",
        )),
        ("is_restarted", ctypes.c_int64),
        ("state_t_ns", ctypes.c_int64),
        ("state", ctypes.c_double * 12),
        ("is_lost", ctypes.c_int64),
        ("row", ctypes.c_double * COLUMNS),
        ("hole_row", ctypes.c_double * COLUMNS),
        *((name, ctypes.c_double) for name in (
            "period_s", "max_jitter_s", "stamp_gain", "gyro_lag_s", "acc_lag_s", "lag_difference_s",
            "max_rate_step", "max_force_step", "full_rate", "full_force",
        )),
        ("origin_ns", ctypes.c_int64),
        ("newest_ns", ctypes.c_int64),
        ("newest_s", ctypes.c_double),
        ("is_begun", ctypes.c_int64),
        ("has_last", ctypes.c_int64),
        ("has_suspect", ctypes.c_int64),
        ("last", ctypes.c_double * 3),
        ("suspect", ctypes.c_double * 3),
        ("has_pose", ctypes.c_int64),
        ("rest_from_s", ctypes.c_double),
        ("rest_to_s", ctypes.c_double),
        ("checkpoint_s", ctypes.c_double),
        ("variance", ctypes.c_double * 13),
        *((name, ctypes.c_double) for name in (
            "gyro_bias", "gyro_tempco", "gyro_gain", "acc_bias_x", "acc_bias_y", "acc_tempco_x",
            "acc_tempco_y", "mxx", "mxy", "myx", "myy", "gx", "gy", "lever_x", "lever_y",
            "theta", "vx", "vy", "px", "py", "omega", "force_x", "force_y",
            "warmth", "temperature_c", "reference_c", "bg", "bax", "bay",
            "good_omega", "good_ax", "good_ay",
        )),
    )  # fmt: skip


_STATE_AT = _Memory.state_t_ns.offset


class CompiledReckoner:
    """Carries the nominal state of the IMU point from packet to packet; see `Reckoner`.

    Args:
        noise: limits of the screen, sensor lag, averaging window.
        counters: where oddities are counted.
        table_map: the slope known beforehand; looked up every few packets.
        core: a compiled one.

    Raises:
        CoreError: the core does not fit.
    """

    __slots__ = (
        "_add", "_address", "_backward", "_buffer", "_counters", "_hole_row", "_is_stale", "_is_started",
        "_keep", "_map", "_memory", "_report", "_row", "_slope", "_until_lookup", "_warm", "has_pose",
        "history",
    )  # fmt: skip

    def __init__(
        self, noise: NoiseModel, counters: Counters, table_map: SlopeGrid | None, core: Core
    ) -> None:
        pointer = ctypes.c_void_p
        self._add = core.function("gs_reckoner_add", ctypes.c_int, pointer)
        self._report = core.function("gs_reckoner_report", None, pointer)
        self._warm = core.function("gs_reckoner_warm", None, pointer)
        size = core.function("gs_reckoner_size", ctypes.c_size_t)()
        if size != ctypes.sizeof(_Memory):
            raise CoreError(f"the compiled reckoner has {size} bytes, not {ctypes.sizeof(_Memory)}")
        self._buffer = bytearray(size)
        self._memory = memory = _Memory.from_buffer(self._buffer)
        self._address = ctypes.addressof(memory)
        row, hole_row = _Memory.row.offset, _Memory.hole_row.offset
        self._row = memoryview(self._buffer)[row : row + _ROW_BYTES]
        self._hole_row = memoryview(self._buffer)[hole_row : hole_row + _ROW_BYTES]
        self._counters = counters
        self._backward = BackwardStamps()
        self._map = table_map
        self._until_lookup = 0
        self._slope = (0.0, 0.0)
        self.has_pose = self._is_started = False
        self._is_stale = True
        self.history = PacketHistory()
        self._keep = self.history.rows.frombytes
        screen = PacketScreen(noise)
        memory.period_s = noise.packet_period_s
        memory.max_jitter_s, memory.stamp_gain = MAX_STAMP_JITTER_S, STAMP_GAIN
        memory.gyro_lag_s, memory.acc_lag_s = noise.gyro_lag_s, noise.acc_lag_s
        memory.lag_difference_s = noise.gyro_lag_s - noise.acc_lag_s
        memory.max_rate_step, memory.max_force_step = screen.max_rate_step, screen.max_acc_step
        memory.full_rate, memory.full_force = noise.full_scale_rad_s, noise.full_scale_m_s2
        memory.rest_from_s, memory.rest_to_s = math.inf, -math.inf
        memory.temperature_c = memory.reference_c = math.nan
        memory.is_lost = 1
        self._unpack(es.initial_state(noise), np.zeros(es.MOVING))

    @property
    def origin_ns(self) -> int | None:
        """Stamp of the internal seconds' origin, None before the first."""
        return self._memory.origin_ns if self._is_started else None

    @property
    def newest_s(self) -> float:
        """End of the newest packet since the origin, smoothed."""
        return self._memory.newest_s  # type: ignore[no-any-return]  # fields of a structure have no types

    @property
    def newest_ns(self) -> int:
        """Stamp of the newest packet."""
        return self._memory.newest_ns  # type: ignore[no-any-return]

    @property
    def omega_rad_s(self) -> float:
        """Rate now, corrected."""
        return self._memory.omega  # type: ignore[no-any-return]

    @property
    def is_lost(self) -> bool:
        """What the report says."""
        return bool(self._memory.is_lost)

    @is_lost.setter
    def is_lost(self, value: bool) -> None:
        self._memory.is_lost = value

    @property
    def checkpoint_s(self) -> float:
        """When the variances held."""
        return self._memory.checkpoint_s  # type: ignore[no-any-return]

    @checkpoint_s.setter
    def checkpoint_s(self, value: float) -> None:
        self._memory.checkpoint_s = value
        self._is_stale = True

    @property
    def variance(self) -> list[float]:
        """Of x, y (five coefficients each) and heading (three) in time since the checkpoint."""
        return list(self._memory.variance)

    @variance.setter
    def variance(self, value: list[float]) -> None:
        self._memory.variance[:] = value
        self._is_stale = True

    @property
    def rest_from_s(self) -> float:
        """Start of the newest rest."""
        return self._memory.rest_from_s  # type: ignore[no-any-return]

    @rest_from_s.setter
    def rest_from_s(self, value: float) -> None:
        self._memory.rest_from_s = value

    @property
    def rest_to_s(self) -> float:
        """Its end."""
        return self._memory.rest_to_s  # type: ignore[no-any-return]

    @rest_to_s.setter
    def rest_to_s(self, value: float) -> None:
        self._memory.rest_to_s = value

    def start_clock(self, t_ns: int) -> None:
        """Fix the origin of the internal seconds, once."""
        if not self._is_started:
            self._is_started = True
            self._memory.origin_ns = self._memory.newest_ns = t_ns

    def add(self, packet: ImuPacket) -> bool:
        """Take one packet; False when its stamp is not after the last one's."""
        if not self._is_started:
            self.start_clock(packet.t_ns - round(packet.dt_s * 1e9))
            self._memory.is_restarted = 1
        _pack(self._buffer, 0, *packet)
        flags = self._add(self._address)
        if flags and not self._is_taken(flags, packet.t_ns):
            return False
        self._keep(self._row)
        self._is_stale = False
        if self._backward.count:
            self._backward.count = 0
        if self._map is not None:
            self._until_lookup -= 1
            if self._until_lookup < 0:
                self._until_lookup = LOOKUP_EVERY
                self._look_up()
        return True

    def _is_taken(self, flags: int, t_ns: int) -> bool:
        """Count what was odd about a packet; False if it was refused."""
        if flags & _BEHIND:
            if not self._clock_restarted(t_ns):
                return False
            flags = self._add(self._address)
        for flag, name in _EVENTS:
            if flags & flag:
                self._counters.add(name)
        if flags & _HOLE:
            self._keep(self._hole_row)
        return True

    def _clock_restarted(self, t_ns: int) -> bool:
        """Count a stamp that lies behind; many in a row are a clock that jumped back, and are followed."""
        self._counters.add("packet_stamp_not_after_the_last")
        if not self._backward.is_restart(t_ns):
            return False
        memory = self._memory
        missed = self._backward.count * memory.period_s
        memory.origin_ns = t_ns - round((memory.newest_s + missed) * 1e9)
        memory.has_last = memory.has_suspect = 0
        memory.is_restarted = 1
        self._counters.add("clock_jumped_back")
        return True

    def report(self) -> PlanarState:
        """Return the state of the centre of mass now: sensor lag undone, lever arm taken off."""
        if self._is_stale:
            self._report(self._address)
            self._is_stale = False
        return PlanarState._make(_unpack_state(self._buffer, _STATE_AT))

    def load(self, x: Array, moved: Array) -> None:
        """Take over a corrected state.

        Args:
            x: (23,) biases, slope, scale and lever arm are taken from it.
            moved: (5,) theta, vx, vy, px, py now.
        """
        memory = self._memory
        memory.has_pose = 1
        self._unpack(x, moved)
        if memory.rest_from_s <= memory.newest_s <= memory.rest_to_s:
            memory.omega = memory.force_x = memory.force_y = 0.0
        else:
            memory.omega = (memory.good_omega - memory.bg) * memory.gyro_gain

    def _unpack(self, state: Array, moved: Array) -> None:
        x = state.tolist()
        self._slope = x[es.SLOPE_X] + x[es.WAVE_X], x[es.SLOPE_Y] + x[es.WAVE_Y]
        _pack_state(
            self._buffer,
            _Memory.gyro_bias.offset,
            x[es.GYRO_BIAS],
            x[es.GYRO_TEMPCO],
            1.0 - x[es.GYRO_SCALE],
            *x[es.ACC_BIAS_X : es.ACC_BIAS_Y + 1],
            *x[es.ACC_TEMPCO_X : es.ACC_TEMPCO_Y + 1],
            1.0 - x[es.ACC_MATRIX],
            x[es.ACC_MATRIX + 1],
            x[es.ACC_MATRIX + 2],
            1.0 - x[es.ACC_MATRIX + 3],
            *self._slope,
            *x[es.LEVER_X : es.LEVER_Y + 1],
            *moved.tolist(),
        )
        self._warm(self._address)
        self._look_up()

    def _look_up(self) -> None:
        if self._map is not None:
            memory = self._memory
            known_x, known_y = self._map.at(memory.px, memory.py)
            memory.gx, memory.gy = self._slope[0] + known_x, self._slope[1] + known_y
        self._is_stale = True


def make_reckoner(
    noise: NoiseModel, counters: Counters, table_map: SlopeGrid | None, core: Core
) -> Reckoner | CompiledReckoner:
    """Return the reckoner of a core; both give the same bits."""
    if core.is_compiled:
        return CompiledReckoner(noise, counters, table_map, core)
    return Reckoner(noise, counters, table_map)
