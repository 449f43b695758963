"""The filter's state and covariance at one moment, and how they go on: over packets and rests, and by a fix.

Pure: a checkpoint is never changed, what was carried or corrected is a new one. Which fixes are believed is
decided elsewhere (`fix_judge`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from groundstation.fusion import error_state as es
from groundstation.fusion import measurements
from groundstation.fusion.carrier import Carrier
from groundstation.fusion.estimator import Array, Counters, Fix
from groundstation.fusion.force_doubt import ForceDoubt
from groundstation.fusion.late_fix import Correction, LateFix
from groundstation.fusion.learned_surface import LearnedSurface, look
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.packet_history import PacketHistory
from groundstation.fusion.rests import Rests
from groundstation.fusion.slope_grid import SlopeGrid
from groundstation.fusion.trace import Carried, Corrected, Step


@dataclass(frozen=True, slots=True, eq=False)
class Checkpoint:
    """What is known at one moment; m nodes of the surface."""

    t_s: float
    x: Array
    """(23 + 2m,) nominal state."""
    P: Array
    """(23 + 2m, 23 + 2m) covariance."""
    surface: LearnedSurface


@dataclass(frozen=True, slots=True, eq=False)
class Fixed:
    """A checkpoint corrected by a fix, unless that lies outside the gate."""

    checkpoint: Checkpoint
    z: Array
    """(3,) innovation."""
    H: Array
    """(3, 23) its Jacobian."""
    correction: Correction


class Course:
    """What was measured and told between two moments: packets, rests, doubts; carries checkpoints over it.

    Args:
        noise: sensors and table of this mock-up.
        table_map: what calibration knows of the table's slope; the states hold what is left of it.
        history: the stored packets.
        counters: where disturbed rests are counted.

    Raises:
        CoreError: there is no compiled core.
    """

    def __init__(
        self, noise: NoiseModel, table_map: SlopeGrid | None, history: PacketHistory, counters: Counters
    ) -> None:
        self.history = history
        self.rests = Rests()
        self.doubt = ForceDoubt(noise.unseen_force_m_s2_rthz)
        self._noise = noise
        self._noise_in_doubt = replace(noise, acc_density_m_s2_rthz=noise.unseen_force_m_s2_rthz)
        self._map = table_map
        self._counters = counters
        self._carrier = Carrier(noise, table_map)
        self._late_fix = LateFix(noise)

    def unknown(self) -> Checkpoint:
        """Return what is known before any fix: no pose."""
        x, P = es.initial_state(self._noise), np.diag(es.initial_variance(self._noise))
        return Checkpoint(0.0, x, P, LearnedSurface.untouched(self._noise))

    def begun(self, before: Checkpoint, fix: Fix, t_s: float, velocity_sigma_m_s: float) -> Checkpoint:
        """Return a checkpoint with the pose of a fix alone; the table's surface is learned anew.

        Args:
            before: what is known besides; (23,).
            fix: pose of the body's origin.
            t_s: its exposure.
            velocity_sigma_m_s: how fast the vehicle may be.
        """
        x, P = before.x.copy(), before.P.copy()
        measurements.take_pose(fix, x, P, float(x[es.THETA]), velocity_sigma_m_s)
        untouched = LearnedSurface.untouched(self._noise)
        surface, x, P, _ = look(untouched, x, P, x[es.PX : es.PY + 1].copy(), self._noise)
        return Checkpoint(t_s, x, P, surface)

    def rested(self, at: Checkpoint, start_s: float) -> Checkpoint:
        """Return the checkpoint with what a rest since `start_s` has shown."""
        x, P = at.x.copy(), at.P.copy()
        self._learn(x, P, start_s, at.t_s)
        return replace(at, x=x, P=P)

    def carry(self, at: Checkpoint, stop_s: float, steps: list[Step] | None = None) -> Checkpoint:
        """Return the checkpoint at a later moment.

        Args:
            at: where to begin.
            stop_s: the moment.
            steps: what is done is written down here, for a smoother.
        """
        surface, x, P = at.surface, at.x.copy(), at.P.copy()
        for a, b, resting in self.rests.stretches(at.t_s, stop_s):
            if resting:
                rows = measurements.stand(x, P)
                es.age(P, b - a, self._noise)
            else:
                surface, x, P, looked = self._late_fix.look(surface, x, P, _ahead(x, 0.5 * (b - a)))
                if steps is not None:
                    steps.append(looked)
                flown = self._carrier.carry(x, self.history, a, b)
                if flown is None:
                    continue
                rows, Q = flown.rows, flown.noise
                unseen = self.doubt.noise(a, b, float(x[es.THETA] + 0.5 * flown.turned_rad))
                es.move(P, rows, Q if unseen is None else Q + unseen)
                x[: es.MOVING] = flown.moved
                es.age(P, flown.duration_s, self._noise)
            if steps is not None:
                steps.append(Carried(b, rows, x[: es.SIZE].copy(), P[: es.SIZE].copy(), resting))
            if resting:
                learned = self._learn(x, P, a, b)
                if learned is not None and steps is not None:
                    steps.append(learned)
        return Checkpoint(stop_s, x, P, surface)

    def correct(self, at: Checkpoint, fix: Fix) -> Fixed:
        """Return the checkpoint at a fix's exposure corrected by it; the same if it lies outside the gate."""
        x, P, noise = at.x.copy(), at.P.copy(), self._noise
        rate_read = self.history.rate_at(at.t_s)
        z, H = measurements.predict_fix(fix, x, rate_read, noise)
        R = measurements.fix_covariance(fix, x, rate_read - x[es.GYRO_BIAS], noise)
        correction = self._late_fix.correct(x, P, z, H, R, noise.gate_nis)
        return Fixed(replace(at, x=x, P=P), z, H, correction)

    def state_at(self, at: Checkpoint, stop_s: float, look_s: float) -> Array:
        """Return the nominal state (23 + 2m,) at a later moment, its slope that of the way to come.

        Args:
            at: where to begin.
            stop_s: the moment.
            look_s: for how long the slope is to hold from then.
        """
        x, here = at.x.copy(), slice(es.WAVE_X, es.WAVE_Y + 1)
        stretches = self.rests.stretches(at.t_s, stop_s)
        is_short = len(stretches) == 1  # then one look, in the middle of it and of the time to come, will do
        for a, b, resting in stretches:
            if resting:
                x[es.VX : es.VY + 1] = 0.0
                continue
            x[here] = self._late_fix.slope(at.surface, x, _ahead(x, 0.5 * (b - a + is_short * look_s)))
            moved = self._carrier.fly(x, self.history, a, b)
            if moved is not None:
                x[: es.MOVING] = moved
        if not is_short:
            x[here] = self._late_fix.slope(at.surface, x, _ahead(x, 0.5 * look_s))
        return x

    def variance_in_time(self, at: Checkpoint, rate_rad_s: float) -> list[float]:
        """Return the variances (13) of the report as polynomials in the time since a checkpoint.

        Args:
            at: where they hold.
            rate_rad_s: the rate since then.
        """
        noise = self._noise_in_doubt if self.doubt.is_open else self._noise
        variance = self._late_fix.variance_in_time(at.x, at.P, noise)
        measurements.add_scale_in_time(variance, at.P, rate_rad_s)
        return variance

    def forget_before(self, t_s: float, *, keep_packets: bool) -> None:
        """Drop what lies before this moment."""
        self.rests.forget_before(t_s)
        self.doubt.forget_before(t_s)
        if not keep_packets:
            self.history.forget_before(t_s)

    def _learn(self, x: Array, P: Array, start_s: float, stop_s: float) -> Corrected | None:
        """Correct biases and slope, in place, by the readings of a rest."""
        segment = self.history.between(start_s, stop_s)
        if self.doubt.touches(segment.start_s, segment.stop_s):
            return None  # readings that were made up teach nothing
        try:
            return measurements.learn_rest(x, P, segment, self._noise, self._map)
        except measurements.RestDisturbed:
            self._counters.add("rest_disturbed")
            return None


def _ahead(x: Array, time_s: float) -> Array:
    """Return the place (2,) where the vehicle will be."""
    return np.asarray(x[es.PX : es.PY + 1] + time_s * x[es.VX : es.VY + 1])
