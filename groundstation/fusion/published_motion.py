"""The published estimators: stars alone, IMU alone, and both with re-integration from each late fix.

As published: zeros are the means of the rest; integration begins with the first sample, from rough initial
conditions, and stores the samples; a star state (two-point velocity included) is 0.6 s late and stored
samples are integrated again from it. IMU alone starts from known initial conditions, here the last fix of the
rest. Stars alone give the newest star state as it is, late. None of them weighs, tests fixes, or estimates
offsets.

Not published, so assumed: samples are integrated again from the middle of the exposure; before the second
fix a star state stands still; a vehicle known to rest stays where it is. Of ours is that the rough start, and
the time after a hole in the packets, are called lost, so that nobody flies by them; and the lever arm to an
IMU block off the vertical through the centre of mass, where the published one stands on it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from groundstation.fusion.constant_offsets import fit_while_flying
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
from groundstation.fusion.packet_history import PacketHistory
from groundstation.fusion.published_settings import AS_PUBLISHED, PublishedMotion
from groundstation.fusion.published_steps import (
    Moving,
    median_zeros_of_rest,
    stepped,
    stepped_exactly,
    zeros_of_rest,
)
from groundstation.fusion.star_states import StarPose, StarStates

LONGEST_HOLE_S = 2.0
"""Longer without packets, and the pose is lost until the next fix; such a hole is not integrated."""
REST_MEMORY_S = 300.0
"""Of a rest the last so much counts."""
STARTED = "it integrates from its start and takes no more fixes"
"""Why IMU alone does not use a fix."""


@dataclass(frozen=True, slots=True)
class Sources:
    """What a published estimator goes by.

    Attributes:
        integrates: Samples of the IMU.
        restarts: Fixes in flight.
    """

    integrates: bool
    restarts: bool


JOINT = Sources(integrates=True, restarts=True)
STARS_ALONE = Sources(integrates=False, restarts=True)
IMU_ALONE = Sources(integrates=True, restarts=False)


class PublishedEstimator:
    """A row of the published estimators.

    Args:
        noise: Lever arm and the fixes' sigma, which is all that is known of the errors.
        settings: What is not published, and additions.
        sources: What it goes by.
    """

    def __init__(
        self, noise: NoiseModel, settings: PublishedMotion = AS_PUBLISHED, sources: Sources = JOINT
    ) -> None:
        self.noise = noise
        self.settings = settings
        self.counters = Counters()
        self._sources = sources
        self._history = PacketHistory()
        self._origin_ns: int | None = None
        self._t_ns = 0
        self._rest_from: float | None = None
        self._flight_from: float | None = None
        self._zeros = (0.0, 0.0, 0.0)
        self._is_fitted = settings.fit_after_s is None
        self._stars = StarStates()
        start = (settings.start_heading_rad, 0.0, 0.0, settings.start_x_m, settings.start_y_m)
        self._now = Moving(*start) if sources.integrates and sources.restarts else None
        self._at_fix: Moving | None = None
        self._rate = 0.0
        self._unused_s = 0.0
        self._last = (0.0, 0.0, 0.0)
        self._is_lost, self._unseen_until = True, -math.inf
        self._waiting: list[Fix] = []
        self._accounts: list[FixOutcome] = []

    def begin_rest(self, t_ns: int) -> None:
        """Say that from this stamp the vehicle stands still."""
        self._start_clock(t_ns)
        self._rest_from = self._seconds(t_ns)
        self._flight_from = None

    def end_rest(self, t_ns: int) -> None:
        """Take the mean of the rest as the zeros."""
        if self._rest_from is None:
            return
        end = self._seconds(t_ns)
        self._take_zeros(self._rest_from, end)
        self._rest_from, self._flight_from = None, end
        self._is_fitted = self.settings.fit_after_s is None
        self._unused_s = 0.0

    def _take_zeros(self, start_s: float, stop_s: float) -> None:
        rest = self._history.between(start_s, stop_s)
        readings = np.array([rest.rate_rad_s, rest.ax_m_s2, rest.ay_m_s2])
        if readings.size:
            take = median_zeros_of_rest if self.settings.median_zeros else zeros_of_rest
            self._zeros = take(*readings)

    def add_imu(self, packet: ImuPacket) -> PlanarState | None:
        """Take one packet and integrate it."""
        self._start_clock(packet.t_ns - round(packet.dt_s * 1e9))
        if packet.t_ns <= self._t_ns:
            self.counters.add("packet_stamp_not_after_the_last")
            return None
        self._t_ns = packet.t_ns
        t = self._seconds(packet.t_ns)
        reading = (packet.rate_rad_s, packet.ax_m_s2, packet.ay_m_s2)
        self._history.rows.extend((t, packet.dt_s, *reading, 0.0, 0.0))
        waiting, self._waiting = self._waiting, []
        for fix in waiting:
            account = self.add_fix(fix)
            if account.reason != WAITS:
                self._accounts.append(account)
        if self._now is not None and self._rest_from is None and self._sources.integrates:
            self._go_on(packet.dt_s, reading, t)
        return self.state()

    def _go_on(self, dt_s: float, reading: tuple[float, float, float], t: float) -> None:
        """Integrate the newest packet."""
        if dt_s > LONGEST_HOLE_S:
            self._is_lost, self._unseen_until = True, t
            self.counters.add("packets_missing_for_long")
            return
        assert self._now is not None
        after, self._unused_s = self._integrated(self._now, dt_s + self._unused_s, reading)
        if self._unused_s:
            self.counters.add("packet_outside_the_gates")
        else:
            self._rate = self._last[0] - self._zeros[0]
        self._now = after

    def _integrated(
        self, state: Moving, step_s: float, reading: tuple[float, float, float]
    ) -> tuple[Moving, float]:
        """Return the state after a sample, and how long it has not been integrated."""
        rate, ax, ay = (value - zero for value, zero in zip(reading, self._zeros, strict=True))
        after = stepped(state, rate, (ax, ay), step_s, needs_both=self.settings.gate_needs_both)
        if after is None:
            if not self.settings.fills_gated:
                return state, step_s
            rate, ax, ay = (value - zero for value, zero in zip(self._last, self._zeros, strict=True))
            after = stepped(state, rate, (ax, ay), step_s) or state
        else:
            self._last = reading
        if self.settings.takes_exact_steps:
            after = stepped_exactly(state, rate, (ax, ay), step_s)
        return after, 0.0

    def _carry(self, state: Moving, start_s: float, stop_s: float) -> tuple[Moving, float]:
        """Integrate the stored samples between two moments again; at rest a vehicle stays where it is."""
        moves_from = math.inf if self._flight_from is None else self._flight_from
        if not self._sources.integrates or stop_s <= moves_from:
            return state, 0.0
        segment = self._history.between(max(start_s, moves_from), stop_s)
        readings = (segment.rate_rad_s.tolist(), segment.ax_m_s2.tolist(), segment.ay_m_s2.tolist())
        unused_s = 0.0
        for step_s, *reading in zip(segment.span_s.tolist(), *readings, strict=True):
            state, unused_s = self._integrated(state, step_s + unused_s, (reading[0], reading[1], reading[2]))
        return state, unused_s

    def add_fix(self, fix: Fix) -> FixOutcome:
        """Put the vehicle where the fix saw it, and integrate the samples since again."""
        t = self._seconds(fix.t_exposure_ns)
        complaint = complaint_about(fix)
        if complaint is not None:
            return self._account(fix, complaint)
        if self._origin_ns is None or not len(self._history) or t < self._history.first_s:
            return self._account(fix, "before the first packet")
        if t > self._seconds(self._t_ns) + 1e-9:
            self._waiting.append(fix)
            return self._account(fix, WAITS)
        newest = self._stars.newest
        if newest is not None and t <= newest.t_s:
            return self._account(fix, "older than the last used")
        resting = self._flight_from is None or t <= self._flight_from
        if not resting and not self._sources.restarts and newest is not None:
            return self._account(fix, STARTED)
        if self._rest_from is not None:  # the mean so far, to be shown
            self._take_zeros(self._rest_from, self._seconds(self._t_ns))
        predicted = None if newest is None or self._at_fix is None else self._predicted(newest.t_s, t)
        lx, ly = self._lever(fix.heading_rad)
        self._stars.add(StarPose(t, fix.x_m + lx, fix.y_m + ly, fix.heading_rad))
        self._fit_offsets(t)
        self._restart(t, stands=resting)
        return self._used(fix, predicted)

    def _predicted(self, start_s: float, stop_s: float) -> Moving:
        assert self._at_fix is not None
        return self._carry(self._at_fix, start_s, stop_s)[0]

    def _restart(self, t: float, *, stands: bool) -> None:
        """Go on from the newest star state."""
        found, standing = self._stars.state(), self._stars.standing()
        assert found is not None
        assert standing is not None
        state, rate = found
        self._at_fix = standing if stands else state
        self._now, self._unused_s = self._carry(self._at_fix, t, self._seconds(self._t_ns))
        if not self._sources.integrates:
            self._rate = 0.0 if stands else rate
        self._is_lost = self._is_lost and t < self._unseen_until
        if self._rest_from is not None:
            self._history.forget_before(t - REST_MEMORY_S)
        elif self._is_fitted:
            self._history.forget_before(t)
            self._stars.forget()

    def _fit_offsets(self, t: float) -> None:
        """Fit the constant offsets over the flight so far, once: an addition."""
        wait_s, flight_from = self.settings.fit_after_s, self._flight_from
        if self._is_fitted or wait_s is None or flight_from is None or t <= flight_from + wait_s:
            return
        self._is_fitted = True
        flight = [pose for pose in self._stars.poses if pose.t_s > flight_from]
        found = fit_while_flying(self._history, flight, self._zeros[0], self.noise.star_sigma_xy_m)
        if found is None:
            self.counters.add("too_few_fixes_for_the_offset_fit")
            return
        self._zeros = (self._zeros[0], found.mu_m_s2, found.nu_m_s2)

    def state(self) -> PlanarState | None:
        """Return the state after the newest packet."""
        if self._now is None:
            return None
        theta, vx, vy, px, py = self._now
        lx, ly = self._lever(theta)
        w = 0.0 if self._rest_from is not None else self._rate
        xy, heading = self.noise.star_sigma_xy_m, self.noise.star_sigma_heading_rad
        return PlanarState(
            self._t_ns,
            px - lx,
            py - ly,
            theta,
            vx + w * ly,
            vy - w * lx,
            w,
            *self._zeros,
            xy,
            xy,
            heading,
            self._is_lost,
        )

    def doubt_forces(self, t_ns: int, *, x: bool, y: bool) -> None:
        """The published methods know no uncertainty that could grow."""

    def expected_forces(self, rate_rad_s: float, push_m_s2: Pair, turn_rad_s2: float) -> Pair:
        """Return the zeros and the push; turning is left out."""
        return self._zeros[1] + push_m_s2[0], self._zeros[2] + push_m_s2[1]

    def slope_left(self) -> tuple[float, float]:
        """The published methods hold bias and slope in one zero and cannot name either."""
        return 0.0, 0.0

    def covariance(self) -> Array:
        """Return (6, 6) with the fixes' variances; the methods know nothing else."""
        C = np.full((6, 6), math.nan)
        xy, heading = self.noise.star_sigma_xy_m**2, self.noise.star_sigma_heading_rad**2
        C[:3, :3] = np.diag([xy, xy, heading])
        return C

    def settled(self) -> list[FixOutcome]:
        """Hand over the accounts of fixes that had to wait for packets."""
        accounts, self._accounts = self._accounts, []
        return accounts

    def _used(self, fix: Fix, predicted: Moving | None) -> FixOutcome:
        account = self._account(fix, "used")
        if predicted is None:
            return account
        lx, ly = self._lever(predicted.heading_rad)
        turned = math.remainder(fix.heading_rad - predicted.heading_rad, math.tau)
        return account._replace(
            innovation_x_m=fix.x_m - predicted.x_m + lx,
            innovation_y_m=fix.y_m - predicted.y_m + ly,
            innovation_heading_rad=turned,
        )

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


class PublishedFactory(Protocol):
    """How a row of the published estimators is made."""

    def __call__(self, noise: NoiseModel, settings: PublishedMotion = AS_PUBLISHED) -> PublishedEstimator:
        """Return a fresh estimator."""


def joint(noise: NoiseModel, settings: PublishedMotion = AS_PUBLISHED) -> PublishedEstimator:
    """Stars and IMU: the row `reintegration`."""
    return PublishedEstimator(noise, settings, JOINT)


def stars_alone(noise: NoiseModel, settings: PublishedMotion = AS_PUBLISHED) -> PublishedEstimator:
    """The newest star state as it is: the row `stars`."""
    return PublishedEstimator(noise, settings, STARS_ALONE)


def imu_alone(noise: NoiseModel, settings: PublishedMotion = AS_PUBLISHED) -> PublishedEstimator:
    """Integration from the last fix of the rest: the row `imu`."""
    return PublishedEstimator(noise, settings, IMU_ALONE)
