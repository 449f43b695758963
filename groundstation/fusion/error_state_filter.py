"""The default estimator: an error-state filter that takes each late fix at its exposure.

The nominal state runs ahead packet by packet in plain floats (`Reckoner`). The covariance stays at the last
used exposure, the checkpoint, and moves only when a fix comes: checkpoint -> exposure over the stored
packets, correction there, then the packets since the exposure are integrated again up to now.
"""

from __future__ import annotations

import copy
import math
from dataclasses import replace

import numpy as np

from groundstation.fusion import error_state as es
from groundstation.fusion import measurements
from groundstation.fusion.agreement import Between, fixes_agree, innovations_agree
from groundstation.fusion.carrier import Carrier
from groundstation.fusion.creep_watch import CreepWatch
from groundstation.fusion.estimator import Array, Counters, Fix, FixAccount, ImuPacket, Pair, PlanarState
from groundstation.fusion.first_fixes import CANDIDATE, CANDIDATE_AGE_S, FirstFixes
from groundstation.fusion.fix_screen import complaint_about
from groundstation.fusion.force_doubt import ForceDoubt
from groundstation.fusion.late_fix import LateFix
from groundstation.fusion.learned_surface import LearnedSurface, look
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.packet_history import PacketHistory, Segment
from groundstation.fusion.past_fixes import Past, PastFixes
from groundstation.fusion.reckoner import Reckoner
from groundstation.fusion.rests import Rests
from groundstation.fusion.slope_grid import SlopeGrid
from groundstation.fusion.trace import Carried, Chain, Corrected, Step, Trace

REOPENED_VELOCITY_M_S = 0.1
"""Sigma of the velocity after the filter found itself lost: faster than anything flies on a table."""
MAX_AHEAD_S = 1.0
"""A fix whose exposure is further ahead of the packets has a wrong stamp."""
LONGEST_HOLE_S = 2.0
"""Without packets for longer, forces and turns may have come and gone that no sigma holds: until a fix agrees
the filter is lost."""
LOOK_NS = 1_000_000_000
"""While no fix comes, how long the local slope is taken to be what it was."""
WAITS = "waits for packets"


class ErrorStateFilter:
    """Heading, position, velocity, biases, slope, scale and lever arm from packets and late fixes.

    Args:
        noise: sensors and table of this mock-up.
        trace: where to write down every step for a smoother; all packets are then kept.
        table_map: what calibration knows of the table's slope; the filter estimates what is left of it.

    Raises:
        CoreError: there is no compiled core.
    """

    def __init__(
        self, noise: NoiseModel, trace: Trace | None = None, table_map: SlopeGrid | None = None
    ) -> None:
        self.noise = noise
        self._map = table_map
        self._trace = trace
        self.counters = Counters()
        self.x = es.initial_state(noise)
        """(23 + 2m,) nominal state at the checkpoint, m nodes of the surface."""
        self.P = np.diag(es.initial_variance(noise))
        """(23 + 2m, 23 + 2m) covariance there."""
        self._surface = LearnedSurface.untouched(noise)
        self._look_due_ns = 0
        self._reckoner = Reckoner(noise, self.counters, table_map)
        self._carrier = Carrier(noise, table_map)
        self._late_fix = LateFix(noise)
        self._checkpoint_s = 0.0
        self._first_fixes = FirstFixes()
        self._past = PastFixes()
        self._rests = Rests()
        self._refused: list[tuple[float, Array]] = []
        self._creep = CreepWatch()
        self._doubt = ForceDoubt(noise.unseen_force_m_s2_rthz)
        self._noise_in_doubt = replace(noise, acc_density_m_s2_rthz=noise.unseen_force_m_s2_rthz)
        self._waiting: list[Fix] = []
        self._accounts: list[FixAccount] = []

    def begin_rest(self, t_ns: int) -> None:
        """Say that from this stamp the vehicle stands still."""
        self._reckoner.start_clock(t_ns)
        if self._rests.begin(self._seconds(t_ns)):
            self._tell_rest()

    def end_rest(self, t_ns: int) -> None:
        """Say that from this stamp the vehicle may move."""
        if self._rests.end(self._seconds(t_ns)):
            self._tell_rest()
            self._integrate_to_now()

    def _tell_rest(self) -> None:
        self._reckoner.rest(*self._rests.newest)

    def add_imu(self, packet: ImuPacket) -> PlanarState | None:
        """Integrate one packet; None before the first fix, or when the packet was refused."""
        reckoner = self._reckoner
        if not reckoner.add(packet):
            return None
        if packet.dt_s > LONGEST_HOLE_S and reckoner.has_pose and self._rests.at(reckoner.newest_s) is None:
            reckoner.is_lost = True
            self.counters.add("packets_missing_for_long")
        if self._waiting:
            self._retry()
        if packet.t_ns > self._look_due_ns:
            self._integrate_to_now()
        return reckoner.report() if reckoner.has_pose else None

    def state(self) -> PlanarState | None:
        """Return the state after the newest packet."""
        return self._reckoner.report() if self._reckoner.has_pose else None

    def covariance(self) -> Array:
        """Return (6, 6) of x, y, heading, vx, vy, omega of the centre of mass now."""
        _, x, P = self._propagate(self._checkpoint_s, self._reckoner.newest_s)
        H = measurements.reported(x, self._reckoner.omega_rad_s)
        C: Array = H @ P[: es.SIZE, : es.SIZE] @ H.T
        C[5, 5] += self.noise.gyro_density_rad_s_rthz**2 / self.noise.packet_period_s
        return C

    def doubt_forces(self, t_ns: int, *, x: bool, y: bool) -> None:
        """Say which accelerometers are not believed from this stamp on."""
        self._reckoner.start_clock(t_ns)
        self._doubt.change(self._seconds(t_ns), x=x, y=y)
        self.counters.add("forces_doubted" if x or y else "forces_believed_again")

    def expected_forces(self, omega_rad_s: float, push_m_s2: Pair, turn_rad_s2: float) -> Pair:
        """Return what the accelerometers would read under a known push of the centre of mass, body axes."""
        x = self.x
        bias_x, bias_y = float(x[es.ACC_BIAS_X]), float(x[es.ACC_BIAS_Y])
        state = self.state()
        if state is not None:  # it holds the temperature's part, and the slope's in body axes
            gx, gy = self.slope_left()
            if self._map is not None:
                known = self._map.at(state.x_m, state.y_m)
                gx, gy = gx + known[0], gy + known[1]
            c, s = math.cos(state.heading_rad), math.sin(state.heading_rad)
            bias_x, bias_y = state.bias_ax_m_s2 + c * gx + s * gy, state.bias_ay_m_s2 + c * gy - s * gx
        w = omega_rad_s - (x[es.GYRO_BIAS] if state is None else state.bias_omega_rad_s)
        rx, ry = float(x[es.LEVER_X]), float(x[es.LEVER_Y])
        return (
            bias_x + push_m_s2[0] - turn_rad_s2 * ry - w * w * rx,
            bias_y + push_m_s2[1] + turn_rad_s2 * rx - w * w * ry,
        )

    def slope_left(self) -> tuple[float, float]:
        """Return the table's pull beyond the map, x, y (m/s^2), as of the last used fix."""
        x = self.x
        return float(x[es.SLOPE_X] + x[es.WAVE_X]), float(x[es.SLOPE_Y] + x[es.WAVE_Y])

    def add_fix(self, fix: Fix) -> FixAccount:
        """Take a fix at its arrival and give account of it."""
        account = self._judge(fix)
        if account.reason == WAITS:
            self._waiting.append(fix)
        return account

    def settled(self) -> list[FixAccount]:
        """Hand over the accounts of fixes that had to wait for packets."""
        accounts, self._accounts = self._accounts, []
        return accounts

    def _retry(self) -> None:
        waiting, self._waiting = self._waiting, []
        for fix in waiting:
            account = self._judge(fix)
            if account.reason == WAITS:
                self._waiting.append(fix)
            else:
                self._accounts.append(account)

    def _judge(self, fix: Fix) -> FixAccount:
        complaint = complaint_about(fix)
        if complaint is not None:
            return self._refuse(fix, complaint)
        reckoner = self._reckoner
        t = self._seconds(fix.t_exposure_ns)
        if not len(reckoner.history) or t < reckoner.history.first_s:
            return self._refuse(fix, "before the first packet")
        if t > reckoner.newest_s + 1e-9:
            if t > reckoner.newest_s + MAX_AHEAD_S:
                return self._refuse(fix, "more than a second ahead of the packets")
            return _account(fix, WAITS)
        self._past.meet(fix.source)
        if not reckoner.has_pose:
            return self._consider(fix)
        if t <= self._checkpoint_s:
            return self._insert(fix, t)
        return self._correct(fix, t)

    def _insert(self, fix: Fix, t: float) -> FixAccount:
        """Take a fix whose exposure lies before some that were used: go back, take it, take those again."""
        split = self._past.before_and_after(fix, t)
        if split is None or self._trace is not None or self._reckoner.is_lost:
            return self._refuse(fix, "older than the last used")
        before, after = split
        self._go_back(before)
        account = self._correct(fix, t, is_late=True)
        if account.used and not all(self._correct(p.fix, p.t_s, is_late=True).used for p in after):
            account = account._replace(used=False, reason="contradicts fixes after it")
            self.counters.add("fix_contradicts_fixes_after_it")
        if not account.used:
            self._go_back([*before, *after])
            return account
        self._integrate_to_now()
        return account

    def _go_back(self, pasts: list[Past]) -> None:
        """Be as after the last of these."""
        last = pasts[-1]
        self._past.replace(pasts)
        self.x, self.P, self._surface = last.x, last.P, last.surface
        self._creep = copy.copy(last.creep)
        self._checkpoint_s = last.t_s

    def _correct(self, fix: Fix, t: float, *, is_late: bool = False) -> FixAccount:
        """Carry the checkpoint to the exposure and correct there, unless the fix lies outside the gate."""
        reckoner = self._reckoner
        steps: list[Step] = []
        surface, x, P = self._propagate(self._checkpoint_s, t, steps)
        omega_read = self._reckoner.history.omega_at(t)
        z, H = measurements.predict_fix(fix, x, omega_read, self.noise)
        R = measurements.fix_covariance(fix, x, omega_read - x[es.GYRO_BIAS], self.noise)
        nis, S, weight, K = self._late_fix.correct(x, P, z, H, R, self.noise.gate_nis)
        if not nis <= self.noise.gate_nis:
            if is_late:
                self.counters.add("fix_outside_the_gate")
                return _account(fix, "outside the gate", z, nis)
            return self._contradicted(fix, t, z, nis)
        creeping = self._creep.variance_to_add(float(z[2]), float(S[2, 2]), t - self._checkpoint_s)
        P[es.GYRO_BIAS, es.GYRO_BIAS] += creeping
        reckoner.is_lost = False
        if self._trace is not None:
            self._trace.chains[-1].steps += [*steps, Corrected(H, K, weight, z)]
        self._accept(fix, t, x, P, surface, is_late=is_late)
        return _account(fix, "used", z, nis, used=True)

    def _refuse(self, fix: Fix, reason: str) -> FixAccount:
        self.counters.add("fix_" + reason.replace(" ", "_"))
        return _account(fix, reason)

    def _contradicted(self, fix: Fix, t: float, z: Array, nis: float) -> FixAccount:
        """Refuse a fix, or believe it when those before it said the same."""
        self.counters.add("fix_outside_the_gate")
        self._refused.append((t, z))
        if len(self._refused) >= self.noise.reopen_after:
            self._reckoner.is_lost = True
            if innovations_agree(self._refused[-self.noise.reopen_after :], self.noise):
                return self._restart(fix, t, z, nis)
        return _account(fix, "outside the gate", z, nis)

    def _consider(self, fix: Fix) -> FixAccount:
        """Start from the first two fixes that agree; one alone may be wrong."""
        first, settled = self._first_fixes.consider(fix, self._agree)
        self._accounts += [_account(old, reason, used=old is first) for old, reason in settled]
        if first is None:
            return _account(fix, CANDIDATE)
        self._start(first)
        return self._judge(fix)

    def _agree(self, first: Fix, second: Fix) -> bool:
        """Whether one vehicle may have been seen at both poses."""
        a, b = self._seconds(first.t_exposure_ns), self._seconds(second.t_exposure_ns)
        if not 0.0 < b - a < CANDIDATE_AGE_S:
            return False
        if self._rests.at(a) is not None and self._rests.at(b) is not None:
            return fixes_agree(first, second, Between(0.0, 0.0, 0.0))
        segment = self._reckoner.history.between(a, b)
        turned = float(((segment.omega_rad_s - self.x[es.GYRO_BIAS]) * segment.span_s).sum())
        null_sigma = math.sqrt(self.P[es.GYRO_BIAS, es.GYRO_BIAS])
        return fixes_agree(first, second, Between(b - a, turned, null_sigma))

    def _start(self, fix: Fix) -> None:
        """Take the first pose, and what the rest so far has shown."""
        x, P, t = self.x.copy(), self.P.copy(), self._seconds(fix.t_exposure_ns)
        rest = self._rests.at(t)
        sigma = REOPENED_VELOCITY_M_S if rest is None else measurements.REST_VELOCITY_M_S
        measurements.take_pose(fix, x, P, float(x[es.THETA]), sigma)
        surface, x, P = self._first_look(x, P)
        if rest is not None:
            self._learn(x, P, self._reckoner.history.between(rest[0], t))
        self._reckoner.has_pose = True
        self._begin_chain(t, x, P)
        self._accept(fix, t, x, P, surface)
        self.counters.add("fix_starts_the_estimate")

    def _restart(self, fix: Fix, t: float, z: Array, nis: float) -> FixAccount:
        """Take the pose from this fix; what made the filter wrong may sit in the biases, so they open too."""
        x = self.x[: es.SIZE].copy()
        P = np.diag(np.minimum(es.initial_variance(self.noise), es.reopened_variance()))
        measurements.take_pose(fix, x, P, float(x[es.THETA]), REOPENED_VELOCITY_M_S)
        surface, x, P = self._first_look(x, P)
        self._begin_chain(t, x, P)
        self._accept(fix, t, x, P, surface)
        self._creep.forget()
        self.counters.add("fix_starts_the_estimate_again")
        return _account(fix, "starts the estimate again", z, nis, used=True)

    def _first_look(self, x: Array, P: Array) -> tuple[LearnedSurface, Array, Array]:
        surface, x, P, _ = look(
            LearnedSurface.untouched(self.noise), x, P, x[es.PX : es.PY + 1].copy(), self.noise
        )
        return surface, x, P

    def _begin_chain(self, t: float, x: Array, P: Array) -> None:
        self._past.forget()
        if self._trace is not None:
            self._trace.chains.append(
                Chain(t, x[: es.SIZE].copy(), P[: es.SIZE].copy(), self._rests.at(t) is not None)
            )

    def _accept(
        self, fix: Fix, t: float, x: Array, P: Array, surface: LearnedSurface, *, is_late: bool = False
    ) -> None:
        """Make the corrected state at `t` the checkpoint and, unless later fixes follow, integrate to now."""
        self.x, self.P, self._surface = x, 0.5 * (P + P.T), surface
        self._checkpoint_s = t
        oldest = self._past.note(Past(t, fix, self.x, self.P, surface, copy.copy(self._creep)))
        if is_late:
            return
        self._refused.clear()
        self._rests.forget_before(oldest)
        self._doubt.forget_before(oldest)
        if self._trace is None:
            self._reckoner.history.forget_before(oldest)
        self._integrate_to_now()

    def _propagate(
        self, start_s: float, stop_s: float, steps: list[Step] | None = None
    ) -> tuple[LearnedSurface, Array, Array]:
        """Return surface, state and covariance carried from the checkpoint `start_s` to `stop_s`."""
        surface, x, P = self._surface, self.x.copy(), self.P.copy()
        for a, b, resting in self._rests.stretches(start_s, stop_s):
            if resting:
                rows = measurements.stand(x, P)
                es.age(P, b - a, self.noise)
            else:
                surface, x, P, looked = self._late_fix.look(surface, x, P, _ahead(x, 0.5 * (b - a)))
                if steps is not None and self._trace is not None:
                    steps.append(looked)
                flown = self._carrier.carry(x, self._reckoner.history, a, b)
                if flown is None:
                    continue
                rows, Q = flown.rows, flown.noise
                unseen = self._doubt.noise(a, b, float(x[es.THETA] + 0.5 * flown.turned_rad))
                es.move(P, rows, Q if unseen is None else Q + unseen)
                x[: es.MOVING] = flown.moved
                es.age(P, flown.duration_s, self.noise)
            if steps is not None and self._trace is not None:
                steps.append(Carried(b, rows, x[: es.SIZE].copy(), P[: es.SIZE].copy(), resting))
            if resting:
                learned = self._learn(x, P, self._reckoner.history.between(a, b))
                if learned is not None and steps is not None:
                    steps.append(learned)
        return surface, x, P

    @property
    def stamp_off_s(self) -> float:
        """How far the newest packet's stamp lies from the tick that its readings hold at."""
        return self._seconds(self._reckoner.newest_ns) - self._reckoner.newest_s

    @property
    def history(self) -> PacketHistory:
        """The stored packets; all of them when there is a trace."""
        return self._reckoner.history

    def finish(self) -> None:
        """Write down the way from the last used fix to the newest packet, for the smoother."""
        if self._trace is not None and self._trace.chains:
            steps: list[Step] = []
            self._propagate(self._checkpoint_s, self._reckoner.newest_s, steps)
            self._trace.chains[-1].steps += steps

    def _learn(self, x: Array, P: Array, segment: Segment) -> Corrected | None:
        if self._doubt.touches(segment.start_s, segment.stop_s):
            return None  # readings that were made up teach nothing
        try:
            return measurements.learn_rest(x, P, segment, self.noise, self._map)
        except measurements.RestDisturbed:
            self.counters.add("rest_disturbed")
            return None

    def _integrate_to_now(self) -> None:
        """Run the nominal state from the checkpoint to now, and prepare the reported sigmas."""
        if not self._reckoner.has_pose:
            return
        x, here = self.x.copy(), slice(es.WAVE_X, es.WAVE_Y + 1)
        stretches = self._rests.stretches(self._checkpoint_s, self._reckoner.newest_s)
        is_short = len(stretches) == 1  # then one look, in its middle and that of the second to come, will do
        for a, b, resting in stretches:
            if resting:
                x[es.VX : es.VY + 1] = 0.0
                continue
            ahead = _ahead(x, 0.5 * (b - a + is_short * 1e-9 * LOOK_NS))
            x[here] = self._late_fix.slope(self._surface, x, ahead)
            moved = self._carrier.fly(x, self._reckoner.history, a, b)
            if moved is not None:
                x[: es.MOVING] = moved
        if not is_short:
            x[here] = self._late_fix.slope(self._surface, x, _ahead(x, 0.5e-9 * LOOK_NS))
        self._look_due_ns = self._reckoner.newest_ns + LOOK_NS
        self._reckoner.load(x[: es.SIZE], x[: es.MOVING])
        noise = self._noise_in_doubt if self._doubt.is_open else self.noise
        variance = self._late_fix.variance_in_time(self.x, self.P, noise)
        measurements.add_scale_in_time(variance, self.P, self._reckoner.omega_rad_s)
        self._reckoner.trust(self._checkpoint_s, variance)

    def _seconds(self, t_ns: int) -> float:
        return (t_ns - (self._reckoner.origin_ns or 0)) * 1e-9


def _ahead(x: Array, time_s: float) -> Array:
    """Return the place (2,) where the vehicle will be."""
    return np.asarray(x[es.PX : es.PY + 1] + time_s * x[es.VX : es.VY + 1])


def _account(
    fix: Fix, reason: str, z: Array | None = None, nis: float = math.nan, *, used: bool = False
) -> FixAccount:
    x, y, heading = (math.nan,) * 3 if z is None else map(float, z)
    return FixAccount(fix.t_exposure_ns, used, reason, x, y, heading, nis, fix.source)
