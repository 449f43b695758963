"""One packet after another integrated in plain floats: what the core's reckoner must equal, bit for bit."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from groundstation.fusion import error_state as es
from groundstation.fusion.estimator import Counters, ImuPacket, PlanarState
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.packet_history import PacketHistory
from groundstation.fusion.reckoner import LOOKUP_EVERY, MAX_AHEAD_S, MAX_STAMP_JITTER_S, STAMP_GAIN
from groundstation.fusion.slope_grid import SlopeGrid
from groundstation.fusion.stamp_doubt import AHEAD_PACKETS, BACKWARD_PACKETS, StampDoubt
from oracles.packet_screen import PacketScreen

Array = NDArray[np.float64]


class OracleReckoner:
    """Carries the nominal state of the IMU point from packet to packet.

    Args:
        noise: limits of the screen, sensor lag, averaging window.
        counters: where oddities are counted.
        table_map: the slope known beforehand; looked up every few packets.
    """

    __slots__ = (
        "_acc_lag", "_ax", "_ay", "_bax", "_bay", "_bg", "_counters", "_doubt",
        "_force_x", "_force_y", "_gx", "_gy", "_gyro_gain", "_gyro_lag", "_lag_difference", "_map",
        "_mxx", "_mxy", "_myx", "_myy", "_period", "_px", "_py", "_rate_read", "_reference_c",
        "_rx", "_ry", "_screen", "_slope_x", "_slope_y", "_temperature_c", "_theta", "_until_lookup",
        "_vx", "_vy", "_warmed_s", "_warmth", "_x", "checkpoint_s", "crossed_s", "has_pose", "history",
        "is_lost", "newest_ns", "newest_s", "origin_ns", "rate_rad_s", "rest_from_s", "rest_to_s", "variance",
    )  # fmt: skip

    def __init__(self, noise: NoiseModel, counters: Counters, table_map: SlopeGrid | None = None) -> None:
        self._counters = counters
        self._map = table_map
        self._until_lookup = 0
        self._screen = PacketScreen(noise)
        self._period = noise.packet_period_s
        self._gyro_lag, self._acc_lag = noise.gyro_lag_s, noise.acc_lag_s
        self._lag_difference = noise.gyro_lag_s - noise.acc_lag_s
        self.history = PacketHistory()
        self.origin_ns: int | None = None
        self.newest_ns = 0
        self.crossed_s = 0.0
        self.newest_s = 0.0
        """End of the newest packet since the origin, smoothed."""
        self.rest_from_s, self.rest_to_s = math.inf, -math.inf
        self.has_pose = False
        self.is_lost = True
        self.checkpoint_s = 0.0
        self.variance = [0.0] * 13
        """Of x, y (five coefficients each) and heading (three) in time since the checkpoint."""
        self.rate_rad_s = 0.0
        self._rate_read = self._ax = self._ay = 0.0
        self._force_x = self._force_y = 0.0
        self._doubt = StampDoubt()
        self._warmth = 0.0
        self._temperature_c = self._reference_c = math.nan
        self._warmed_s = 0.0
        self._theta = self._vx = self._vy = self._px = self._py = 0.0
        self._x = es.initial_state(noise).tolist()
        self._unpack()

    def seconds(self, t_ns: int) -> float:
        """Return a stamp in s since the origin."""
        return (t_ns - (self.origin_ns or 0)) * 1e-9

    def rest(self, from_s: float, to_s: float) -> None:
        """Say between which moments the vehicle stands still."""
        self.rest_from_s, self.rest_to_s = from_s, to_s

    def trust(self, checkpoint_s: float, variance: list[float]) -> None:
        """Say when the variances held, and what they are."""
        self.checkpoint_s, self.variance = checkpoint_s, variance

    def start_clock(self, t_ns: int) -> None:
        """Fix the origin of the internal seconds, once."""
        if self.origin_ns is None:
            self.origin_ns = t_ns
            self.newest_ns = t_ns

    def add(self, packet: ImuPacket) -> bool:
        """Take one packet; False when its stamp is not after the last one's."""
        t_ns, dt, rate, ax, ay, temperature_c = packet
        if self.origin_ns is None:
            self.start_clock(t_ns - round(dt * 1e9))
        elif t_ns <= self.newest_ns:
            if not self._clock_restarted(t_ns):
                return False
        elif self.history.rows and self.seconds(t_ns) - (self.newest_s + dt) > MAX_AHEAD_S:
            self._counters.add("packet_stamp_far_ahead_of_the_ticks")
            if not self._doubt.is_followed(t_ns, AHEAD_PACKETS):
                return False
        if not self.history.rows:  # whatever came before the first packet is not a hole in the packets
            dt = self._period
            self.newest_s = (t_ns - self.origin_ns) * 1e-9 - dt  # type: ignore[operator]  # set above
        t = self.newest_s + dt
        off = (t_ns - self.origin_ns) * 1e-9 - t  # type: ignore[operator]  # start_clock has set the origin
        if -MAX_STAMP_JITTER_S < off < MAX_STAMP_JITTER_S:
            t += STAMP_GAIN * off
        else:
            self._counters.add("packet_ticks_and_stamps_disagree")
            t += off
            dt = t - self.newest_s
        self.newest_ns, self.newest_s = t_ns, t
        self._doubt.count = 0
        if temperature_c == self._temperature_c:
            self._warmed_s = t
        elif self._is_heat(temperature_c, t):
            self._warmed_s = t
            self._warm(temperature_c)
        elif not math.isnan(temperature_c):
            self._counters.add("packet_temperature_set_aside")
        hole = 0.0
        if self._screen.is_wild(rate, ax, ay, dt / self._period):
            self._counters.add("packet_wild")
            rate, ax, ay, hole = self._rate_read, self._ax, self._ay, 1.0
        if dt > 1.5 * self._period:
            self._counters.add("packet_hole")
            self.crossed_s = gap = dt - self._period
            dt = self._period
            self._advance(
                t - dt,
                gap,
                0.5 * (rate + self._rate_read),
                0.5 * (ax + self._ax),
                0.5 * (ay + self._ay),
                1.0,
            )
        self._rate_read, self._ax, self._ay = rate, ax, ay
        self._advance(t, dt, rate, ax, ay, hole)
        if self._map is not None:
            self._until_lookup -= 1
            if self._until_lookup < 0:
                self._until_lookup = LOOKUP_EVERY
                self._look_up()
        return True

    def _clock_restarted(self, t_ns: int) -> bool:
        """Count a stamp that lies behind; many in a row are a clock that jumped back, and are followed."""
        self._counters.add("packet_stamp_not_after_the_last")
        if not self._doubt.is_followed(t_ns, BACKWARD_PACKETS):
            return False
        missed = self._doubt.count * self._period
        self.origin_ns = t_ns - round((self.newest_s + missed) * 1e9)
        self._counters.add("clock_jumped_back")
        self._screen.forget()
        return True

    def _advance(self, t: float, dt: float, rate: float, ax: float, ay: float, hole: float) -> None:
        """Store one stretch of constant readings and integrate it."""
        self.history.rows.extend((t, dt, rate, ax, ay, self._warmth, hole))
        if self.rest_from_s <= t <= self.rest_to_s or not self.has_pose:
            return
        w = (rate - self._bg) * self._gyro_gain
        ux = ax - self._bax
        uy = ay - self._bay
        fx = self._mxx * ux - self._mxy * uy
        fy = self._myy * uy - self._myx * ux
        turn = w * dt
        theta = self._theta + 0.5 * turn + self._lag_difference * w
        c = math.cos(theta)
        s = math.sin(theta)
        self._force_x = ax = c * fx - s * fy + self._gx
        self._force_y = ay = s * fx + c * fy + self._gy
        vx, vy = self._vx, self._vy
        self._px += (vx + 0.5 * ax * dt) * dt
        self._py += (vy + 0.5 * ay * dt) * dt
        self._vx = vx + ax * dt
        self._vy = vy + ay * dt
        self._theta += turn
        self.rate_rad_s = w

    def report(self) -> PlanarState:
        """Return the state of the centre of mass now: sensor lag undone, lever arm taken off."""
        w = self.rate_rad_s
        # the stamp of the row jitters about the tick that the state holds at
        off = (self.newest_ns - (self.origin_ns or 0)) * 1e-9 - self.newest_s
        theta = self._theta + (self._gyro_lag + off) * w
        lag = self._acc_lag + off
        vx, vy = self._vx, self._vy
        c = math.cos(theta)
        s = math.sin(theta)
        lever_x = c * self._rx - s * self._ry
        lever_y = s * self._rx + c * self._ry
        gx, gy = self._gx, self._gy
        tau = self.newest_s - self.checkpoint_s
        x0, x1, x2, x3, x4, y0, y1, y2, y3, y4, h0, h1, h2 = self.variance
        return PlanarState(
            self.newest_ns,
            self._px + lag * vx - lever_x,
            self._py + lag * vy - lever_y,
            theta,
            vx + lag * self._force_x + w * lever_y,
            vy + lag * self._force_y - w * lever_x,
            w,
            self._bg,
            self._bax - c * gx - s * gy,
            self._bay + s * gx - c * gy,
            math.sqrt(x0 + tau * (x1 + tau * (x2 + tau * (x3 + tau * x4)))),
            math.sqrt(y0 + tau * (y1 + tau * (y2 + tau * (y3 + tau * y4)))),
            math.sqrt(h0 + tau * (h1 + tau * h2)),
            self.is_lost,
        )

    def load(self, x: Array, moved: Array) -> None:
        """Take over a corrected state.

        Args:
            x: (23,) biases, slope, scale and lever arm are taken from it.
            moved: (5,) theta, vx, vy, px, py now.
        """
        self.has_pose = True
        self._x = x.tolist()
        self._theta, self._vx, self._vy, self._px, self._py = moved.tolist()
        self._unpack()
        if self.rest_from_s <= self.newest_s <= self.rest_to_s:
            self.rate_rad_s = self._force_x = self._force_y = 0.0
        else:
            self.rate_rad_s = (self._rate_read - self._bg) * self._gyro_gain

    def _is_heat(self, temperature_c: float, t: float) -> bool:
        if not -60.0 <= temperature_c <= 150.0:
            return False
        step = abs(temperature_c - self._temperature_c)
        return math.isnan(self._temperature_c) or step <= 3.0 + 1.0 * (t - self._warmed_s)

    def _warm(self, temperature_c: float) -> None:
        self._temperature_c = temperature_c
        if math.isnan(self._reference_c):
            self._reference_c = temperature_c
        self._warmth = temperature_c - self._reference_c
        self._correct_for_warmth()

    def _unpack(self) -> None:
        x = self._x
        self._gyro_gain = 1.0 - x[es.GYRO_SCALE]
        self._mxx, self._mxy = 1.0 - x[es.ACC_MATRIX], x[es.ACC_MATRIX + 1]
        self._myx, self._myy = x[es.ACC_MATRIX + 2], 1.0 - x[es.ACC_MATRIX + 3]
        self._slope_x = x[es.SLOPE_X] + x[es.WAVE_X]
        self._slope_y = x[es.SLOPE_Y] + x[es.WAVE_Y]
        self._rx, self._ry = x[es.LEVER_X], x[es.LEVER_Y]
        self._correct_for_warmth()
        self._look_up()

    def _correct_for_warmth(self) -> None:
        x, warmth = self._x, self._warmth
        self._bg = x[es.GYRO_BIAS] + x[es.GYRO_TEMPCO] * warmth
        self._bax = x[es.ACC_BIAS_X] + x[es.ACC_TEMPCO_X] * warmth
        self._bay = x[es.ACC_BIAS_Y] + x[es.ACC_TEMPCO_Y] * warmth

    def _look_up(self) -> None:
        self._gx, self._gy = self._slope_x, self._slope_y
        if self._map is not None:
            known_x, known_y = self._map.at(self._px, self._py)
            self._gx += known_x
            self._gy += known_y
