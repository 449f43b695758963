"""Which fixes are believed: the policy of the filter.

A fix is refused unseen, waits for its packets or for a second witness, corrects the checkpoint, is inserted
before fixes of another source, or lies outside the gate; several of the last kind that agree begin the
estimate again.
"""

from __future__ import annotations

import copy
import math
from dataclasses import replace

import numpy as np

from groundstation.fusion import error_state as es
from groundstation.fusion.agreement import Between, fixes_agree, innovations_agree
from groundstation.fusion.checkpoint import Checkpoint, Course
from groundstation.fusion.creep_watch import CreepWatch
from groundstation.fusion.estimator import WAITS, Array, Counters, Fix, FixOutcome
from groundstation.fusion.first_fixes import CANDIDATE, CANDIDATE_AGE_S, FirstFixes
from groundstation.fusion.fix_screen import complaint_about
from groundstation.fusion.measurements import REST_VELOCITY_M_S
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.past_fixes import Past, PastFixes
from groundstation.fusion.reckoner import Reckoner
from groundstation.fusion.trace import Chain, Corrected, Step, Trace

REOPENED_VELOCITY_M_S = 0.1
"""Sigma of the velocity after the filter found itself lost: faster than anything flies on a table."""
MAX_AHEAD_S = 1.0
"""A fix whose exposure is further ahead of the packets has a wrong stamp."""


class FixJudge:
    """Keeps the checkpoint of the fixes that were believed.

    Args:
        noise: gate, sigmas.
        course: what lies between the fixes.
        reckoner: the clock; told when the estimate is lost.
        counters: where verdicts are counted.
        trace: where to write down every step for a smoother; all packets are then kept.

    Attributes:
        checkpoint: After the newest fix that was believed.
        has_pose: Whether there was one.
        waiting: Fixes whose packets have not come.
        unseen_until_s: End of the last hole in which anything may have happened; no fix from before it shows
            that the filter is found again.
    """

    def __init__(
        self, noise: NoiseModel, course: Course, reckoner: Reckoner, counters: Counters, trace: Trace | None
    ) -> None:
        self._noise, self._course, self._reckoner = noise, course, reckoner
        self._counters, self._trace = counters, trace
        self.checkpoint = course.unknown()
        self.has_pose = False
        self._first_fixes = FirstFixes()
        self._past = PastFixes()
        self._refused: list[tuple[float, Array]] = []
        self._creep = CreepWatch()
        self.waiting: list[Fix] = []
        self._accounts: list[FixOutcome] = []
        self.unseen_until_s = -math.inf

    def add(self, fix: Fix) -> FixOutcome:
        """Take a fix at its arrival and give account of it."""
        account = self._judge(fix)
        if account.reason == WAITS:
            self.waiting.append(fix)
        return account

    def retry(self) -> None:
        """Judge again the fixes that waited for packets."""
        waiting, self.waiting = self.waiting, []
        for fix in waiting:
            account = self._judge(fix)
            if account.reason == WAITS:
                self.waiting.append(fix)
            else:
                self._accounts.append(account)

    def settled(self) -> list[FixOutcome]:
        """Hand over the accounts of fixes that had to wait."""
        accounts, self._accounts = self._accounts, []
        return accounts

    def finish(self) -> None:
        """Write down the way from the last used fix to the newest packet, for the smoother."""
        self._write_down_until(self._reckoner.newest_s)

    def begin_anew(self, from_s: float, until_s: float) -> None:
        """Forget the pose: nobody knows what happened between these moments.

        Args:
            from_s: End of the last packet before.
            until_s: End of the first one after.
        """
        self._write_down_until(from_s)
        self.has_pose = False
        at = self.checkpoint
        limits = np.minimum(es.initial_variance(self._noise), es.reopened_variance())
        self.checkpoint = replace(self._course.unknown(), t_s=until_s, x=at.x[: es.SIZE], P=np.diag(limits))
        self._first_fixes = FirstFixes()
        self._refused.clear()
        self._past.forget()
        self._creep.forget()
        self._course.forget_before(until_s, keep_packets=self._trace is not None)

    def _write_down_until(self, t_s: float) -> None:
        if self._trace is not None and self._trace.chains and self.has_pose:
            self._course.carry(self.checkpoint, t_s, self._trace.chains[-1].steps)

    def _judge(self, fix: Fix) -> FixOutcome:
        complaint = complaint_about(fix)
        if complaint is not None:
            return self._refuse(fix, complaint)
        reckoner, history = self._reckoner, self._course.history
        t = reckoner.seconds(fix.t_exposure_ns)
        if not len(history) or t < history.first_s:
            return self._refuse(fix, "before the first packet")
        if not self.has_pose and t < self.unseen_until_s:
            return self._refuse(fix, "before a pause in the packets")
        if t > reckoner.newest_s + 1e-9:
            if t > reckoner.newest_s + MAX_AHEAD_S:
                return self._refuse(fix, "more than a second ahead of the packets")
            return _account(fix, WAITS)
        self._past.meet(fix.source)
        if not self.has_pose:
            return self._consider(fix)
        if t <= self.checkpoint.t_s:
            return self._insert(fix, t)
        return self._correct(fix, t)

    def _refuse(self, fix: Fix, reason: str) -> FixOutcome:
        self._counters.add("fix_" + reason.replace(" ", "_"))
        return _account(fix, reason)

    def _correct(self, fix: Fix, t: float, *, is_late: bool = False) -> FixOutcome:
        """Carry the checkpoint to the exposure and correct there, unless the fix lies outside the gate."""
        steps: list[Step] | None = None if self._trace is None else []
        fixed = self._course.correct(self._course.carry(self.checkpoint, t, steps), fix)
        (nis, S, weight, K), z = fixed.correction, fixed.z
        if not nis <= self._noise.gate_nis:
            if is_late:
                self._counters.add("fix_outside_the_gate")
                return _account(fix, "outside the gate", z, nis)
            return self._contradicted(fix, t, z, nis)
        creeping = self._creep.variance_to_add(float(z[2]), float(S[2, 2]), t - self.checkpoint.t_s)
        P = fixed.checkpoint.P
        P[es.GYRO_BIAS, es.GYRO_BIAS] += creeping
        if t >= self.unseen_until_s:
            self._reckoner.is_lost = False
        if self._trace is not None and steps is not None:
            self._trace.chains[-1].steps += [*steps, Corrected(fixed.H, K, weight, z)]
        self._accept(fix, fixed.checkpoint, is_late=is_late)
        return _account(fix, "used", z, nis, used=True)

    def _insert(self, fix: Fix, t: float) -> FixOutcome:
        """Take a fix whose exposure lies before some that were used: go back, take it, take those again."""
        split = self._past.before_and_after(fix, t)
        if split is None or self._trace is not None or self._reckoner.is_lost:
            return self._refuse(fix, "older than the last used")
        before, after = split
        self._go_back(before)
        account = self._correct(fix, t, is_late=True)
        if account.used and not all(self._correct(p.fix, p.t_s, is_late=True).used for p in after):
            account = account._replace(used=False, reason="contradicts fixes after it")
            self._counters.add("fix_contradicts_fixes_after_it")
        if not account.used:
            self._go_back([*before, *after])
        return account

    def _go_back(self, pasts: list[Past]) -> None:
        """Be as after the last of these."""
        last = pasts[-1]
        self._past.replace(pasts)
        self.checkpoint = last.checkpoint
        self._creep = copy.copy(last.creep)

    def _contradicted(self, fix: Fix, t: float, z: Array, nis: float) -> FixOutcome:
        """Refuse a fix, or believe it when those before it reported the same."""
        self._counters.add("fix_outside_the_gate")
        self._refused.append((t, z))
        if len(self._refused) >= self._noise.reopen_after:
            self._reckoner.is_lost = True
            if innovations_agree(self._refused[-self._noise.reopen_after :], self._noise):
                return self._restart(fix, t, z, nis)
        return _account(fix, "outside the gate", z, nis)

    def _consider(self, fix: Fix) -> FixOutcome:
        """Start from the first two fixes that agree; one alone may be wrong."""
        first, settled = self._first_fixes.consider(fix, self._agree)
        self._accounts += [_account(old, reason, used=old is first) for old, reason in settled]
        if first is None:
            return _account(fix, CANDIDATE)
        self._start(first)
        return self._judge(fix)

    def _agree(self, first: Fix, second: Fix) -> bool:
        """Whether one vehicle may have been seen at both poses."""
        a, b = (self._reckoner.seconds(fix.t_exposure_ns) for fix in (first, second))
        if not 0.0 < b - a < CANDIDATE_AGE_S:
            return False
        rests, at = self._course.rests, self.checkpoint
        if rests.at(a) is not None and rests.at(b) is not None:
            return fixes_agree(first, second, Between(0.0, 0.0, 0.0))
        segment = self._course.history.between(a, b)
        turned = float(((segment.rate_rad_s - at.x[es.GYRO_BIAS]) * segment.span_s).sum())
        null_sigma = math.sqrt(at.P[es.GYRO_BIAS, es.GYRO_BIAS])
        return fixes_agree(first, second, Between(b - a, turned, null_sigma))

    def _start(self, fix: Fix) -> None:
        """Take the first pose, and what the rest so far has shown."""
        t = self._reckoner.seconds(fix.t_exposure_ns)
        rest = self._course.rests.at(t)
        sigma_m_s = REOPENED_VELOCITY_M_S if rest is None else REST_VELOCITY_M_S
        begun = self._course.begun(self.checkpoint, fix, t, sigma_m_s)
        if rest is not None:
            begun = self._course.rested(begun, rest[0])
        self.has_pose = True
        self._begin_chain(begun)
        self._accept(fix, begun)
        self._counters.add("fix_starts_the_estimate")

    def _restart(self, fix: Fix, t: float, z: Array, nis: float) -> FixOutcome:
        """Take the pose from this fix; what made the filter wrong may sit in the biases, so they open too."""
        P = np.diag(np.minimum(es.initial_variance(self._noise), es.reopened_variance()))
        doubted = replace(self.checkpoint, x=self.checkpoint.x[: es.SIZE], P=P)
        begun = self._course.begun(doubted, fix, t, REOPENED_VELOCITY_M_S)
        self._begin_chain(begun)
        self._accept(fix, begun)
        self._creep.forget()
        self._counters.add("fix_starts_the_estimate_again")
        return _account(fix, "starts the estimate again", z, nis, used=True)

    def _begin_chain(self, at: Checkpoint) -> None:
        self._past.forget()
        if self._trace is not None:
            is_rest = self._course.rests.at(at.t_s) is not None
            self._trace.chains.append(Chain(at.t_s, at.x[: es.SIZE].copy(), at.P[: es.SIZE].copy(), is_rest))

    def _accept(self, fix: Fix, at: Checkpoint, *, is_late: bool = False) -> None:
        """Make it the checkpoint; forget what no later fix can ask for, unless later ones follow at once."""
        self.checkpoint = replace(at, P=0.5 * (at.P + at.P.T))
        oldest_s = self._past.note(Past(fix, self.checkpoint, copy.copy(self._creep)))
        if is_late:
            return
        self._refused.clear()
        self._course.forget_before(oldest_s, keep_packets=self._trace is not None)


def _account(
    fix: Fix, reason: str, z: Array | None = None, nis: float = math.nan, *, used: bool = False
) -> FixOutcome:
    x, y, heading = (math.nan,) * 3 if z is None else map(float, z)
    return FixOutcome(fix.t_exposure_ns, used, reason, x, y, heading, nis, fix.source)
