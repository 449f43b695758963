"""What every peer needs around its filter: packets kept for the late fix, the estimate carried to now."""

import math
from abc import ABC, abstractmethod
from collections import deque

import numpy as np

from bench.fusion.planar import GYRO, HEADING, POSITION, SIZE, Array, Reading, moved, pose_of
from groundstation.fusion.estimator import Counters, Fix, FixOutcome, ImuPacket, PlanarState
from groundstation.fusion.noise import NoiseModel

NS = 1e-9
SAME_NIS = 16.0
_NAN = math.nan


class LatePeer(ABC):
    """An estimator by the contract of ``groundstation.fusion.estimator``, its filter still open.

    A packet that jumps from the one before is replaced by it, once. The packet that an exposure falls into
    is cut there. What follows the exposure is integrated open loop. It starts when two fixes in a row agree.
    """

    def __init__(self, noise: NoiseModel) -> None:
        self.noise, self.counters = noise, Counters()
        self._x = np.zeros(SIZE)
        """At the newest exposure."""
        self._sigma = np.full(3, _NAN)
        """Of x, y, heading at the newest exposure."""
        self._now: Array | None = None
        self._after: deque[Reading] = deque()
        self._first: Fix | None = None
        self._newest = Reading(0.0, 0.01, 0.0, 0.0, 0.0)
        self._has_jumped = True
        self._rest_until_s = 0.0

    @abstractmethod
    def _start(self) -> None:
        """Begin at the state, which stands where a fix says."""

    @abstractmethod
    def _advance(self, reading: Reading) -> None:
        """Bring the filter over one reading, at rest or not."""

    @abstractmethod
    def _correct(self, fix: Fix, innovation: Array) -> tuple[bool, float]:
        """Take a fix at the filter's stamp; give whether it was believed, and its NIS."""

    def begin_rest(self, t_ns: int) -> None:
        """Stand still until told."""
        del t_ns
        self._rest_until_s = math.inf

    def end_rest(self, t_ns: int) -> None:
        """Move."""
        self._rest_until_s = t_ns * NS

    def is_at_rest(self, reading: Reading) -> bool:
        """Whether the vehicle stood during a reading."""
        return reading.end_s <= self._rest_until_s

    def add_imu(self, packet: ImuPacket) -> PlanarState | None:
        """Integrate open loop."""
        reading = self._screened(
            Reading(packet.t_ns * NS, packet.dt_s, packet.rate_rad_s, packet.ax_m_s2, packet.ay_m_s2)
        )
        self._after.append(reading)
        if self._now is None:
            return None
        if not self.is_at_rest(reading):
            self._now = moved(self._now, reading)
        return self.state()

    def _screened(self, reading: Reading) -> Reading:
        last = self._newest
        force = max(abs(reading.ax_m_s2 - last.ax_m_s2), abs(reading.ay_m_s2 - last.ay_m_s2))
        rate = abs(reading.rate_rad_s - last.rate_rad_s)
        jumps = not (force < self.noise.max_acc_step_m_s2 and rate < self.noise.max_rate_step_rad_s)
        if jumps and not self._has_jumped:
            self._has_jumped = True
            self.counters.add("packet_jump")
            return last._replace(end_s=reading.end_s, dt_s=reading.dt_s)
        self._has_jumped = False
        self._newest = reading
        return reading

    def add_fix(self, fix: Fix) -> FixOutcome:
        """Go to the exposure, correct, run open loop to now."""
        until_s = fix.t_exposure_ns * NS
        if self._now is None:
            is_proved = self._is_near(self._first, fix)
            self._first = fix
            if not is_proved:
                return FixOutcome(fix.t_exposure_ns, False, "waits for a second", _NAN, _NAN, _NAN, _NAN)
            resting = []
            while self._after and self._after[0].end_s <= until_s:
                resting.append(self._after.popleft())
            if resting and self.is_at_rest(resting[-1]):
                self._x[GYRO] = np.mean([reading.rate_rad_s for reading in resting])
            self._x[HEADING] = fix.heading_rad
            self._x[POSITION] = np.array([fix.x_m, fix.y_m]) - pose_of(self._x, self.noise)[:2]
            self._start()
            account = FixOutcome(fix.t_exposure_ns, True, "starts the estimate", _NAN, _NAN, _NAN, _NAN)
        else:
            self._go_to(until_s)
            innovation = np.array([fix.x_m, fix.y_m, fix.heading_rad]) - pose_of(self._x, self.noise)
            innovation[2] = math.remainder(innovation[2], math.tau)
            used, nis = self._correct(fix, innovation)
            reason = "used" if used else "outside the gate"
            account = FixOutcome(fix.t_exposure_ns, used, reason, *innovation.tolist(), nis)
        now = self._x
        for reading in self._after:
            if not self.is_at_rest(reading):
                now = moved(now, reading)
        self._now = now
        return account

    @staticmethod
    def _is_near(first: Fix | None, second: Fix) -> bool:
        """Whether two fixes show the same pose, standing still."""
        if first is None:
            return False
        turn = math.remainder(second.heading_rad - first.heading_rad, math.tau)
        off = np.array([second.x_m - first.x_m, second.y_m - first.y_m, turn])
        return float(off @ np.linalg.solve(first.covariance + second.covariance, off)) < SAME_NIS

    def _go_to(self, until_s: float) -> None:
        while self._after and self._after[0].end_s <= until_s:
            self._advance(self._after.popleft())
        if self._after:
            first = self._after.popleft()
            before_s = min(max(first.dt_s - (first.end_s - until_s), 0.0), first.dt_s)
            if before_s > 0.0:
                self._advance(first._replace(end_s=until_s, dt_s=before_s))
            self._after.appendleft(first._replace(dt_s=first.dt_s - before_s))

    def settled(self) -> list[FixOutcome]:
        """Nothing waits here."""
        return []

    def state(self) -> PlanarState | None:
        """The state of the centre of mass; sigmas are those at the newest exposure."""
        if self._now is None:
            return None
        x, newest = self._now, self._newest
        rate = 0.0 if newest.end_s <= self._rest_until_s else newest.rate_rad_s - float(x[GYRO])
        px, py, heading = pose_of(x, self.noise).tolist()
        lx, ly = (x[POSITION] - (px, py)).tolist()
        c, s = math.cos(x[HEADING]), math.sin(x[HEADING])
        return PlanarState(
            round(newest.end_s / NS), px, py, heading, x[1] + rate * ly, x[2] - rate * lx, rate,
            x[GYRO], x[6] - c * x[8] - s * x[9], x[7] + s * x[8] - c * x[9], *self._sigma.tolist(), False,
        )  # fmt: skip

    def covariance(self) -> Array:
        """Not offered."""
        raise NotImplementedError
