"""The published method: a late fix replaces the pose at its exposure, the packets since are integrated again.

As published for planar air-bearing mock-ups with a slow star tracker: zero offsets from the mean at rest,
gates on impossible readings, integration in the table frame, velocity from the difference of two fixes, and
one least-squares fit of the constant offsets (mu, nu) over the first stretch of flight. It knows no wrong
fixes, no slope and no covariance; it is the baseline that the default filter is compared with.
"""

from __future__ import annotations

import math

import numpy as np

from groundstation.fusion.estimator import (
    WAITS,
    Array,
    Counters,
    Fix,
    FixOutcome,
    ImuPacket,
    Pair,
    PlanarState,
)
from groundstation.fusion.fix_screen import complaint_about
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.offset_fit import fit_offsets
from groundstation.fusion.packet_history import PacketHistory, Segment

MAX_ACC_M_S2 = 0.5
"""Published anomaly gate."""
MAX_RATE_RAD_S = math.radians(50.0)
"""Published anomaly gate."""
LONGEST_HOLE_S = 2.0
"""Longer without packets, and the pose is lost until the next fix; such a hole is not integrated."""
FIT_STRETCH_S = 20.0
"""Flight over which the offsets are fitted, once."""


class ReintegrationEstimator:
    """Delay-compensated dead reckoning from the newest fix.

    Args:
        noise: lever arm and the fixes' sigma, which is all that is known of the errors.
    """

    def __init__(self, noise: NoiseModel) -> None:
        self.noise = noise
        self.counters = Counters()
        self._history = PacketHistory()
        self._origin_ns: int | None = None
        self._t_ns = 0
        self._rest_from: float | None = None
        self._flight_from: float | None = None
        self._offsets = np.zeros(3)  # rate, mu, nu
        self._is_fitted = False
        self._fixes: list[tuple[float, float, float, float]] = []  # exposure, IMU point x, y, heading
        self._pose: list[float] | None = None  # theta, vx, vy, px, py of the IMU point
        self._pose_at_fix: list[float] = []  # the same at the exposure of the newest fix
        self._rate = 0.0
        self._is_lost, self._unseen_until = False, -math.inf
        self._last = (0.0, 0.0, 0.0)
        self._waiting: list[Fix] = []
        self._accounts: list[FixOutcome] = []

    def begin_rest(self, t_ns: int) -> None:
        """Say that from this stamp the vehicle stands still."""
        self._start_clock(t_ns)
        self._rest_from = self._seconds(t_ns)
        self._flight_from = None

    def end_rest(self, t_ns: int) -> None:
        """Take the mean of the rest as the zero offsets."""
        if self._rest_from is None:
            return
        end = self._seconds(t_ns)
        self._calibrate(self._rest_from, end)
        self._rest_from, self._flight_from, self._is_fitted = None, end, False

    def _calibrate(self, start_s: float, stop_s: float) -> None:
        rest = self._history.between(start_s, stop_s)
        if len(rest.span_s):
            self._offsets = np.array([rest.rate_rad_s.mean(), rest.ax_m_s2.mean(), rest.ay_m_s2.mean()])

    def add_imu(self, packet: ImuPacket) -> PlanarState | None:
        """Integrate one packet; readings outside the gates are replaced by the last good ones."""
        self._start_clock(packet.t_ns - round(packet.dt_s * 1e9))
        if packet.t_ns <= self._t_ns:
            self.counters.add("packet_stamp_not_after_the_last")
            return None
        rate, ax, ay = packet.rate_rad_s, packet.ax_m_s2, packet.ay_m_s2
        if not (abs(rate) <= MAX_RATE_RAD_S and abs(ax) <= MAX_ACC_M_S2 and abs(ay) <= MAX_ACC_M_S2):
            self.counters.add("packet_outside_the_gates")
            rate, ax, ay = self._last
        self._last = (rate, ax, ay)
        self._t_ns = packet.t_ns
        t = self._seconds(packet.t_ns)
        self._history.rows.extend((t, packet.dt_s, rate, ax, ay, 0.0, 0.0))
        waiting, self._waiting = self._waiting, []
        for fix in waiting:
            account = self.add_fix(fix)
            if account.reason != WAITS:
                self._accounts.append(account)
        if self._pose is None:
            return None
        if self._rest_from is None:
            if packet.dt_s > LONGEST_HOLE_S:
                self._is_lost, self._unseen_until = True, t
                self.counters.add("packets_missing_for_long")
            else:
                self._pose = self._integrate(self._pose, packet.dt_s, rate, ax, ay)
            self._rate = rate - float(self._offsets[0])
        return self.state()

    def _integrate(self, pose: list[float], dt: float, rate: float, ax: float, ay: float) -> list[float]:
        theta, vx, vy, px, py = pose
        w = rate - float(self._offsets[0])
        fx, fy = ax - float(self._offsets[1]), ay - float(self._offsets[2])
        middle = theta + 0.5 * w * dt
        c, s = math.cos(middle), math.sin(middle)
        gx, gy = c * fx - s * fy, s * fx + c * fy
        return [
            theta + w * dt,
            vx + gx * dt,
            vy + gy * dt,
            px + (vx + 0.5 * gx * dt) * dt,
            py + (vy + 0.5 * gy * dt) * dt,
        ]

    def _carry(self, pose: list[float], start_s: float, stop_s: float) -> list[float]:
        """Integrate the stored packets between two moments; at rest a vehicle stays where it is."""
        moves_from = math.inf if self._flight_from is None else self._flight_from
        if stop_s <= moves_from:
            return pose
        segment = self._history.between(max(start_s, moves_from), stop_s)
        for dt, w, ax, ay in zip(*self._columns(segment), strict=True):
            pose = self._integrate(pose, dt, w, ax, ay)
        return pose

    def state(self) -> PlanarState | None:
        """Return the state after the newest packet."""
        if self._pose is None:
            return None
        theta, vx, vy, px, py = self._pose
        lx, ly = self._lever(theta)
        w = self._rate
        bias, mu, nu = self._offsets.tolist()
        xy, heading = self.noise.star_sigma_xy_m, self.noise.star_sigma_heading_rad
        return PlanarState(
            self._t_ns,
            px - lx,
            py - ly,
            theta,
            vx + w * ly,
            vy - w * lx,
            w,
            bias,
            mu,
            nu,
            xy,
            xy,
            heading,
            self._is_lost,
        )

    def doubt_forces(self, t_ns: int, *, x: bool, y: bool) -> None:
        """The published method knows no uncertainty that could grow."""

    def expected_forces(self, rate_rad_s: float, push_m_s2: Pair, turn_rad_s2: float) -> Pair:
        """Return the constant offsets and the push; turning is left out."""
        _, mu, nu = self._offsets.tolist()
        return mu + push_m_s2[0], nu + push_m_s2[1]

    def slope_left(self) -> tuple[float, float]:
        """The published method holds bias and slope in one offset and cannot name either."""
        return 0.0, 0.0

    def covariance(self) -> Array:
        """Return (6, 6) with the fixes' variances; the method knows nothing else."""
        C = np.full((6, 6), math.nan)
        xy, heading = self.noise.star_sigma_xy_m**2, self.noise.star_sigma_heading_rad**2
        C[:3, :3] = np.diag([xy, xy, heading])
        return C

    def settled(self) -> list[FixOutcome]:
        """Hand over the accounts of fixes that had to wait for packets."""
        accounts, self._accounts = self._accounts, []
        return accounts

    def add_fix(self, fix: Fix) -> FixOutcome:
        """Put the vehicle where the fix saw it, and integrate the packets since."""
        t = self._seconds(fix.t_exposure_ns)
        complaint = complaint_about(fix)
        if complaint is not None:
            return self._account(fix, complaint)
        if self._origin_ns is None or not len(self._history) or t < self._history.first_s:
            return self._account(fix, "before the first packet")
        if t > self._seconds(self._t_ns) + 1e-9:
            self._waiting.append(fix)
            return self._account(fix, WAITS)
        if self._fixes and t <= self._fixes[-1][0]:
            return self._account(fix, "older than the last used")
        if self._rest_from is not None:  # the mean so far, to be shown
            self._calibrate(self._rest_from, self._seconds(self._t_ns))
        predicted = self._carry(self._pose_at_fix, self._fixes[-1][0], t) if self._fixes else None
        near = self._pose[0] if self._pose else 0.0
        heading = near + math.remainder(fix.heading_rad - near, math.tau)
        lx, ly = self._lever(heading)
        self._fixes.append((t, fix.x_m + lx, fix.y_m + ly, heading))
        resting = self._flight_from is None or t <= self._flight_from
        if not resting and not self._is_fitted and t > (self._flight_from or 0.0) + FIT_STRETCH_S:
            self._fit()
        velocity = (0.0, 0.0) if resting else self._finite_difference()
        self._pose_at_fix = [heading, *velocity, fix.x_m + lx, fix.y_m + ly]
        self._pose = self._carry(self._pose_at_fix, t, self._seconds(self._t_ns))
        self._is_lost = self._is_lost and t < self._unseen_until
        if self._is_fitted:
            self._history.forget_before(t)
            self._fixes = self._fixes[-2:]
        return self._used(fix, predicted)

    def _used(self, fix: Fix, predicted: list[float] | None) -> FixOutcome:
        account = self._account(fix, "used")
        if predicted is None:
            return account
        theta, _, _, px, py = predicted
        lx, ly = self._lever(theta)
        turned = math.remainder(fix.heading_rad - theta, math.tau)
        return account._replace(
            innovation_x_m=fix.x_m - px + lx, innovation_y_m=fix.y_m - py + ly, innovation_heading_rad=turned
        )

    def _finite_difference(self) -> tuple[float, float]:
        if len(self._fixes) < 2:
            return 0.0, 0.0
        (t0, x0, y0, _), (t1, x1, y1, _) = self._fixes[-2:]
        return (x1 - x0) / (t1 - t0), (y1 - y0) / (t1 - t0)

    def _fit(self) -> None:
        """Fit (mu, nu) over the flight so far, once."""
        self._is_fitted = True
        flight = [f for f in self._fixes if f[0] > (self._flight_from or 0.0)]
        if len(flight) < 4:
            self.counters.add("too_few_fixes_for_the_offset_fit")
            return
        t = np.array([f[0] for f in flight])
        segment = self._history.between(t[0] - 0.1, t[-1])
        step = (segment.rate_rad_s - self._offsets[0]) * segment.span_s
        turned = np.cumsum(step)
        heading = flight[0][3] + turned - np.interp(t[0], segment.end_s, turned) - 0.5 * step
        force = np.array([segment.ax_m_s2, segment.ay_m_s2])
        points = np.array([[f[1] for f in flight], [f[2] for f in flight]])
        fit = fit_offsets(
            segment.end_s, segment.span_s, heading, force, t, points, self.noise.star_sigma_xy_m
        )
        self._offsets[1:] = fit.mu_m_s2, fit.nu_m_s2

    @staticmethod
    def _columns(segment: Segment) -> list[list[float]]:
        return [
            segment.span_s.tolist(),
            segment.rate_rad_s.tolist(),
            segment.ax_m_s2.tolist(),
            segment.ay_m_s2.tolist(),
        ]

    def _account(self, fix: Fix, reason: str) -> FixOutcome:
        if reason != "used":
            self.counters.add("fix_" + reason.replace(" ", "_"))
        nan = math.nan
        return FixOutcome(fix.t_exposure_ns, reason == "used", reason, nan, nan, nan, nan, fix.source)

    def _lever(self, theta: float) -> tuple[float, float]:
        c, s = math.cos(theta), math.sin(theta)
        rx, ry = self.noise.imu_offset_x_m, self.noise.imu_offset_y_m
        return c * rx - s * ry, s * rx + c * ry

    def _start_clock(self, t_ns: int) -> None:
        if self._origin_ns is None:
            self._origin_ns = self._t_ns = t_ns

    def _seconds(self, t_ns: int) -> float:
        return (t_ns - (self._origin_ns or 0)) * 1e-9
