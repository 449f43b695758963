"""The hot path: one packet after another integrated by the core (``reckon.c``), three microseconds each.

The state lives in a structure that C and Python share; a packet is written into it, one call integrates it,
and the report is read from it.
"""

from __future__ import annotations

import math
from struct import Struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.core.library import default_core
from groundstation.fusion import error_state as es
from groundstation.fusion.estimator import Counters, ImuPacket, PlanarState
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.packet_history import PacketHistory
from groundstation.fusion.slope_grid import SlopeGrid
from groundstation.fusion.stamp_doubt import AHEAD_PACKETS, BACKWARD_PACKETS, StampDoubt

Array = NDArray[np.float64]

STAMP_GAIN = 0.02
"""Share of a stamp's difference from the ticks that is followed; smooths the jitter of the stamps."""
MAX_STAMP_JITTER_S = 0.02
"""A stamp that is further from its tick than this is not jitter: the clock or the sensor jumped."""
MAX_AHEAD_S = 1.0
"""A stamp further ahead of its tick is not acted on before the next ones go on from it."""
LOOKUP_EVERY = 8
"""Packets between look-ups of the table's map; a vehicle moves millimetres meanwhile."""
NOISE_SIGMAS = 6.0
"""Of the difference of two packets; one in a hundred million is beyond, and wild."""


def largest_steps(noise: NoiseModel) -> tuple[float, float]:
    """Return how much rate (rad/s) and force (m/s^2) may differ from packet to packet.

    The limits are the rig's: largest force and torque over mass and inertia, plus noise.
    """
    per_packet = NOISE_SIGMAS * math.sqrt(2.0 / noise.packet_period_s)
    return (
        noise.max_rate_step_rad_s + per_packet * noise.gyro_density_rad_s_rthz,
        noise.max_acc_step_m_s2 + per_packet * noise.acc_density_m_s2_rthz,
    )


def layout_of(ffi: Any, name: str) -> Struct:  # noqa: ANN401 - cffi
    """Return how a structure of plain numbers lies in memory, as the core's header declares it."""
    codes = {"int64_t": "q", "double": "d", "_Bool": "?"}
    return Struct("=" + "".join(codes[field.type.cname] for _, field in ffi.typeof(name).fields))


class Reckoner:
    """Carries the nominal state of the IMU point from packet to packet.

    Args:
        noise: limits of the screen, sensor lag, averaging window.
        counters: where oddities are counted.
        table_map: the slope known beforehand; looked up every few packets.

    Attributes:
        now: The shared structure, field by field in ``api.h``.
        history: The packets so far.
        has_pose: Whether a state was loaded.
        origin_ns: Stamp of the internal seconds' origin, None before the first.
        crossed_s: Length of the newest hole in the packets; whoever acts on it sets it back to 0.

    Raises:
        CoreError: there is no core.
    """

    __slots__ = (
        "_add", "_asked", "_counters", "_doubt", "_events", "_hole_row", "_is_stale", "_keep", "_lib",
        "_map", "_read", "_row", "_slope", "_state", "_until_lookup", "_write", "crossed_s", "has_pose",
        "history", "now", "origin_ns",
    )  # fmt: skip

    def __init__(self, noise: NoiseModel, counters: Counters, table_map: SlopeGrid | None = None) -> None:
        core = default_core()
        lib, ffi = core.lib, core.ffi
        self._lib, self._add = lib, lib.gs_reckoner_add
        # as bytes, all fields of a record at once: ten times as fast as one after the other
        self._write = layout_of(ffi, "ImuPacket").pack_into
        self._read = layout_of(ffi, "PlanarState").unpack_from
        self._events = (
            (lib.WILD, "packet_wild"),
            (lib.HOLE, "packet_hole"),
            (lib.DISAGREE, "packet_ticks_and_stamps_disagree"),
            (lib.HEAT, "packet_temperature_set_aside"),
        )
        self.now = now = ffi.new("Reckoner *")
        self._asked, self._state, self._row, self._hole_row = (
            ffi.buffer(ffi.addressof(now, name)) for name in ("asked", "state", "row", "hole_row")
        )
        self._counters = counters
        self._doubt = StampDoubt()
        self.crossed_s = 0.0
        self._map = table_map
        self._until_lookup = 0
        self._slope = (0.0, 0.0)
        self.origin_ns: int | None = None
        self.is_lost = self._is_stale = True
        self.has_pose = False
        self.history = PacketHistory()
        self._keep = self.history.rows.frombytes
        now.period_s = noise.packet_period_s
        now.max_jitter_s, now.stamp_gain, now.max_ahead_s = MAX_STAMP_JITTER_S, STAMP_GAIN, MAX_AHEAD_S
        now.gyro_lag_s, now.acc_lag_s = noise.gyro_lag_s, noise.acc_lag_s
        now.lag_difference_s = noise.gyro_lag_s - noise.acc_lag_s
        now.max_rate_step, now.max_force_step = largest_steps(noise)
        now.full_rate, now.full_force = noise.full_scale_rad_s, noise.full_scale_m_s2
        now.rest_from_s, now.rest_to_s = math.inf, -math.inf
        now.temperature_c = now.reference_c = math.nan
        self._unpack(es.initial_state(noise), np.zeros(es.MOVING))

    @property
    def newest_s(self) -> float:
        """End of the newest packet since the origin, smoothed."""
        return float(self.now.newest_s)

    @property
    def newest_ns(self) -> int:
        """Stamp of the newest packet."""
        return int(self.now.newest_ns)

    @property
    def rate_rad_s(self) -> float:
        """Rate now, corrected."""
        return float(self.now.rate)

    @property
    def is_lost(self) -> bool:
        """What the report states."""
        return bool(self.now.state.is_lost)

    @is_lost.setter
    def is_lost(self, value: bool) -> None:
        self.now.state.is_lost = value

    def start_clock(self, t_ns: int) -> None:
        """Fix the origin of the internal seconds, once."""
        if self.origin_ns is None:
            self.origin_ns = self.now.origin_ns = self.now.newest_ns = t_ns

    def seconds(self, t_ns: int) -> float:
        """Return a stamp in s since the origin."""
        return (t_ns - (self.origin_ns or 0)) * 1e-9

    def rest(self, from_s: float, to_s: float) -> None:
        """Say between which moments the vehicle stands still."""
        self.now.rest_from_s, self.now.rest_to_s = from_s, to_s

    def trust(self, checkpoint_s: float, variance: list[float]) -> None:
        """Say what the sigmas of the report are made from.

        Args:
            checkpoint_s: when the variances held.
            variance: (13,) of x, y (five coefficients each) and heading (three) in time since then.
        """
        self.now.checkpoint_s = checkpoint_s
        self.now.variance = variance
        self._is_stale = True

    def add(self, packet: ImuPacket) -> bool:
        """Take one packet; False when its stamp is not after the last one's, or waits for a witness."""
        if self.origin_ns is None:
            self.start_clock(packet.t_ns - round(packet.dt_s * 1e9))
            self.now.is_restarted = True
        self._write(self._asked, 0, *packet)
        flags = self._add(self.now)
        if flags and not self._is_taken(flags, packet.t_ns):
            return False
        self._keep(self._row)
        self._is_stale = False
        if self._doubt.count:
            self._doubt.count = 0
        if self._map is not None:
            self._until_lookup -= 1
            if self._until_lookup < 0:
                self._until_lookup = LOOKUP_EVERY
                self._look_up()
        return True

    def _is_taken(self, flags: int, t_ns: int) -> bool:
        """Count what was odd about a packet; False if it was refused."""
        if flags & self._lib.BEHIND:
            if not self._clock_restarted(t_ns):
                return False
            flags = self._add(self.now)
        elif flags & self._lib.AHEAD:
            self._counters.add("packet_stamp_far_ahead_of_the_ticks")
            if not self._doubt.is_followed(t_ns, AHEAD_PACKETS):
                return False
            self.now.is_restarted = True
            flags = self._add(self.now)
        for flag, name in self._events:
            if flags & flag:
                self._counters.add(name)
        if flags & self._lib.HOLE:
            self._keep(self._hole_row)
            self.crossed_s = float(self.now.hole_row.span_s)
        return True

    def _clock_restarted(self, t_ns: int) -> bool:
        """Count a stamp that lies behind; many in a row are a clock that jumped back, and are followed."""
        self._counters.add("packet_stamp_not_after_the_last")
        if not self._doubt.is_followed(t_ns, BACKWARD_PACKETS):
            return False
        now = self.now
        missed = self._doubt.count * now.period_s
        self.origin_ns = now.origin_ns = t_ns - round((now.newest_s + missed) * 1e9)
        now.has_last = now.has_suspect = False
        now.is_restarted = True
        self._counters.add("clock_jumped_back")
        return True

    def report(self) -> PlanarState:
        """Return the state of the centre of mass now: sensor lag undone, lever arm taken off."""
        if self._is_stale:
            self._lib.gs_reckoner_report(self.now)
            self._is_stale = False
        return PlanarState._make(self._read(self._state))

    def load(self, x: Array, moved: Array) -> None:
        """Take over a corrected state.

        Args:
            x: (23,) biases, slope, scale and lever arm are taken from it.
            moved: (5,) theta, vx, vy, px, py now.
        """
        now = self.now
        self.has_pose = now.has_pose = True
        self._unpack(x, moved)
        if now.rest_from_s <= now.newest_s <= now.rest_to_s:
            now.rate = now.force_x = now.force_y = 0.0
        else:
            now.rate = (now.good.rate - now.bg) * now.gyro_gain

    def _unpack(self, state: Array, moved: Array) -> None:
        x, now = state.tolist(), self.now
        self._slope = x[es.SLOPE_X] + x[es.WAVE_X], x[es.SLOPE_Y] + x[es.WAVE_Y]
        now.gyro_bias, now.gyro_tempco, now.gyro_gain = (
            x[es.GYRO_BIAS],
            x[es.GYRO_TEMPCO],
            1.0 - x[es.GYRO_SCALE],
        )
        now.acc_bias_x, now.acc_bias_y = x[es.ACC_BIAS_X], x[es.ACC_BIAS_Y]
        now.acc_tempco_x, now.acc_tempco_y = x[es.ACC_TEMPCO_X], x[es.ACC_TEMPCO_Y]
        now.mxx, now.mxy = 1.0 - x[es.ACC_MATRIX], x[es.ACC_MATRIX + 1]
        now.myx, now.myy = x[es.ACC_MATRIX + 2], 1.0 - x[es.ACC_MATRIX + 3]
        now.gx, now.gy = self._slope
        now.lever_x, now.lever_y = x[es.LEVER_X], x[es.LEVER_Y]
        now.theta, now.vx, now.vy, now.px, now.py = moved.tolist()
        self._lib.gs_reckoner_warm(now)
        self._look_up()

    def _look_up(self) -> None:
        if self._map is not None:
            now = self.now
            known_x, known_y = self._map.at(now.px, now.py)
            now.gx, now.gy = self._slope[0] + known_x, self._slope[1] + known_y
        self._is_stale = True
